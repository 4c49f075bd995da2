"""What is believed of a leg of the robot: probabilities, zeros that are no finding, and the random runs behind them."""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from testbed.benchmarks.diagnosis.robot_benchmark import RobotBlindTest, scores
from testbed.benchmarks.diagnosis.robot_calibration import fit, read_trials, restated
from testbed.benchmarks.diagnosis.robot_trials import drawn, hidden_sizes
from testbed.benchmarks.harness import LINES
from testbed.diagnosis.robot.probabilities import RobotSigns, calibration, distribution
from testbed.diagnosis.robot.zeros import zeros
from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.machine.names import AXES

LEFT, RIGHT = "sensor.gain_a@fl_vertical", "sensor.gain_a@fr_vertical"


def found(gain: float, fall: float, behind: float = 30.0) -> RobotSigns:
    """Signs of one good name and one rival."""
    return RobotSigns(gain, fall, 0.0, 0.0, 1.1, (((LEFT,), gain), ((RIGHT,), gain - behind)))


def test_probabilities_add_up_to_one() -> None:
    for s in (
        found(0.0, 0.0),
        found(30.0, 0.1),
        found(500.0, 0.9),
        RobotSigns(0.0, 0.0, 0.0, 0.0, 9.0, ()),
    ):
        assert sum(distribution(s, calibration()).values()) == pytest.approx(1.0, abs=1e-12)


def test_a_large_gain_is_believed_and_a_small_one_is_not() -> None:
    large, small = (
        distribution(s, calibration()) for s in (found(400.0, 0.9, 350.0), found(4.0, 0.01))
    )
    assert large[(LEFT,)] > 0.8
    assert max(small, key=lambda n: small[n]) == ()


def test_a_rival_behind_by_slack_has_a_quarter_of_the_leader_at_power_two() -> None:
    never = {"one": -30.0, "worst": 0.0, "gain": 0.0, "fall": 0.0, "more": 0.0, "first": 0.0}
    weights = {
        "strange": never,
        "presence": never | {"one": 30.0},
        "second": never,
        "rivals": {"slack": 10.0, "share": 0.1, "power": 2.0},
    }
    shares = distribution(found(100.0, 0.5, 20.0), weights)  # slack 10 + 0.1 * 100
    assert shares[(RIGHT,)] / shares[(LEFT,)] == pytest.approx(0.25)
    assert shares[(LEFT,)] == pytest.approx(0.8)


def test_signs_are_read_as_they_were_written() -> None:
    s = found(30.0, 0.1)
    assert RobotSigns.from_json(json.loads(json.dumps(s.as_json()))) == s


def test_zeros_may_be_what_the_data_sheet_allows() -> None:
    """1.25 % of 100 bar over 40 K are 3125 Pa/K; 20 K off, through both areas of 70 and 40 mm, and 20 N."""
    signals = SimpleNamespace(oil_temperature_degc=np.full(10, 60.0))
    problem = SimpleNamespace(series=[SimpleNamespace(name=AXES[2], signals=signals)])
    (active,), (coordinate,) = zeros(problem, build_machine())  # type: ignore[arg-type]
    areas = math.pi / 4.0 * (2.0 * 0.07**2 - 0.04**2)
    assert (
        coordinate.high
        == pytest.approx(3125.0 * 20.0 * areas + 20.0)
        == pytest.approx(422.5, abs=0.1)
    )
    assert coordinate.low == -coordinate.high
    assert active.effect.name == coordinate.owner == "unnamed@fl_vertical" and not any(
        active.values.values()
    )


def test_every_seed_draws_its_own_run_and_every_effect_has_its_turn() -> None:
    names = []
    for seed in range(len(hidden_sizes())):
        scenario, name, place = drawn(seed)
        again = drawn(seed)
        assert again[0] == scenario and again[1:] == (name, place)
        assert [(u.effect, u.at) for u in scenario.undeclared] == ([(name, place)] if name else [])
        names.append(name)
    assert names == list(hidden_sizes())


def trial(seed: int, truth: str, said: str, gain: float) -> dict[str, object]:
    """A run as its file has it."""
    return {
        "seed": seed,
        "kind": "single" if truth else "clean",
        "truth": [truth] if truth else [],
        "numbers": {"gain_error": 0.1} if truth else {},
        "visible": bool(truth),
        "verdict": "effect" if said else "none",
        "names": [said] if said else [],
        "effects": [{"parameters": {"gain_error": {"value": 0.1, "interval90": [0.05, 0.15]}}}]
        if said
        else [],
        "hypotheses": [{"names": [said] if said else [], "probability": 1.0}],
        "error": {"before": 300.0, "refit": 200.0, "after": 100.0},
        "signs": found(gain, 0.3).as_json(),
    }


def test_scores_count_legs_and_effects_and_sound_machines() -> None:
    trials = [
        trial(1, LEFT, LEFT, 90.0),
        trial(2, LEFT, RIGHT, 90.0),
        trial(3, "", "", 1.0),
        trial(4, "", RIGHT, 20.0),
    ]
    found_of = scores(trials)
    assert (
        found_of["leg_and_effect_named"]["share"] == 0.5 and found_of["clean_none"]["share"] == 0.5
    )
    assert found_of["intervals"] == {**found_of["intervals"], "share": 1.0, "of": 1}
    by_effect = RobotBlindTest().tables(found_of)[1]
    assert ["sensor.gain_a", "50%", "2"] in by_effect.rows


def test_the_fit_learns_that_a_gain_of_forty_is_nothing_here(tmp_path: Path) -> None:
    rows = [
        trial(k, LEFT if k % 3 == 0 else "", "", 200.0 if k % 3 == 0 else 40.0) for k in range(30)
    ]
    lines = [{"case": str(k), "mark": "", "answer": row} for k, row in enumerate(rows)]
    (tmp_path / LINES).write_text("\n".join(map(json.dumps, lines)))
    trials = read_trials([tmp_path])
    stated = restated(trials, fit(trials))
    assert all((t["verdict"] == "effect") == bool(t["truth"]) for t in stated)
    with pytest.raises(InputError, match="holds no finished cases"):
        read_trials([tmp_path / "runs"])
