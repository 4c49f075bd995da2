"""A warning is right only if its foot is lost for 20 ms within two seconds; every other case counts as it must."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from testbed.benchmarks.contact_loss.loads import KEPT, means, off_ground, packed, unpacked

from testbed.benchmarks.contact_loss.scenes import Scene
from testbed.benchmarks.contact_loss.score import find_losses
from testbed.benchmarks.contact_loss.warning import (
    judged,
    looked_at,
    marks,
    outcome,
    outcomes,
    raised,
)
from testbed.benchmarks.contact_loss.warning_numbers import report
from testbed.benchmarks.harness import LINES
from testbed.errors import InputError
from testbed.estimation.detectors.warning import NUMBERS, STEP_S

DT = 1e-3


def _loads(*parts: tuple[float, float, float]) -> np.ndarray:
    """Foot 0 goes through (seconds, from N, to N) in turn at 1 kHz, the others bear 5 kN."""
    foot = np.concatenate([np.linspace(a, b, round(s / DT)) for s, a, b in parts])
    out = np.full((len(foot), 4), 5000.0)
    out[:, 0] = foot
    return out


def _kept(normal: np.ndarray) -> np.ndarray:
    return means(normal, DT).astype(float) * 5.0


def _judged(
    t: float, *parts: tuple[float, float, float], carrying: bool = True
) -> tuple[bool, str] | None:
    normal = _loads(*parts)
    return judged(0, t, off_ground(normal, np.full(normal.shape, carrying), DT), _kept(normal))


@pytest.mark.parametrize(
    ("parts", "word"),
    [
        (((5, 4000, 4000), (1, 0, 0), (4, 4000, 4000)), "early"),
        (((4.1, 4000, 4000), (1, 0, 0), (4, 4000, 4000)), "early"),
        (((4.09, 4000, 4000), (1, 0, 0), (4, 4000, 4000)), "lost"),
        (((4.1, 4000, 4000), (1.9, 4000, 4000), (1, 0, 0), (4, 4000, 4000)), "early"),
        (((6.1, 4000, 4000), (1, 0, 0), (4, 4000, 4000)), "false"),
        (((5, 4000, 4000), (0.019, 0, 0), (5, 4000, 4000)), "near"),
        (((5, 4000, 4000), (1, 301, 301), (4, 4000, 4000)), "near"),
        (((5, 4000, 4000), (1, 601, 601), (4, 4000, 4000)), "false"),
        (((3.6, 4000, 4000), (0.1, 0, 0), (1, 4000, 4000), (1, 0, 0), (4, 4000, 4000)), "late"),
    ],
)
def test_what_becomes_of_a_warning_at_four_seconds(
    parts: tuple[tuple[float, float, float], ...], word: str
) -> None:
    found = _judged(4.0, *parts)
    assert found == (True, word)


def test_a_foot_that_is_lifted_on_purpose_is_no_loss_and_a_light_foot_is_told_apart() -> None:
    parts = ((5.0, 4000.0, 4000.0), (1.0, 0.0, 0.0), (4.0, 4000.0, 4000.0))
    assert _judged(4.0, *parts, carrying=False) == (True, "near")
    assert _judged(4.0, (5, 1500, 1500), (1, 0, 0), (4, 1500, 1500)) == (False, "early")


def test_two_seconds_that_the_scene_cuts_off_judge_nothing_however_they_began() -> None:
    assert _judged(4.0, (5, 4000, 4000), (0.9, 0, 0)) is None
    assert _judged(4.0, (5.9, 4000, 4000)) is None


def test_a_slow_fall_is_warned_of_in_time_and_one_that_the_foot_across_ends_is_not() -> None:
    """5 kN at 3 kN/s: 20 % is reached 0.23 s before 300 N. Where the foot across falls ahead of it, its fall ends."""
    alone = _loads((5, 5000, 5000), (1.6, 5000, 200), (2.5, 0, 0))
    scene = {
        "off": off_ground(alone, np.ones(alone.shape, dtype=bool), DT),
        "losses": [
            vars(loss) for loss in find_losses(alone, np.ones(alone.shape, dtype=bool), DT, 2.0)
        ],
    }
    kept = _kept(alone)
    found = outcome(scene, looked_at(kept), kept, NUMBERS)
    assert (found["early"], found["lost"], found["near"], found["false"]) == (1, 1, 0, 0)
    assert 0.1 <= found["leads_s"][0] <= 0.4
    together = alone.copy()
    together[:, 3] = np.maximum(alone[:, 0] - 600.0, -50.0)
    together[:, 0] = np.maximum(alone[:, 0], 850.0)  # three feet bear the rest
    kept = _kept(together)
    assert [foot for foot, _ in raised(looked_at(kept), NUMBERS)] == [3]


def _thrust(*parts: tuple[float, float, float], rising_until_s: float) -> np.ndarray:
    """A plan (m, 2) of 5 ms that goes through (seconds, from N, to N), known to rise until a time."""
    thrust = np.concatenate([np.linspace(a, b, round(s / STEP_S)) for s, a, b in parts])
    end = (np.arange(len(thrust)) + 1) * STEP_S
    rising = np.where(np.gradient(thrust) > 0.0, np.maximum(rising_until_s - end, 0.0), 0.0)
    return np.stack([thrust, rising], axis=1)


def test_a_fall_by_the_thrust_ends_where_the_thrust_stops_rising() -> None:
    """5 kN at 3 kN/s while the thrust rises by 12 kN/s: it ends 1.4 s after it began, at 800 N. So it is planned.

    One who does not know that foresees 300 N at 1100 N; nor does a thrust of 1 kN/s explain such a fall.
    """
    normal = _kept(_loads((5, 5000, 5000), (1.4, 5000, 800), (3, 800, 800)))
    strong = _thrust((5, 0, 0), (1.4, 0, 16800), (3, 16800, 16800), rising_until_s=6.4)
    weak = _thrust((5, 0, 0), (1.4, 0, 1400), (3, 1400, 1400), rising_until_s=6.4)
    numbers = {**NUMBERS, "warn_at": 600.0}
    assert raised(looked_at(normal, strong), numbers) == []
    for plan in (weak, None):
        ((foot, t),) = raised(looked_at(normal, plan), numbers)
        assert foot == 0 and 6.0 < t < 6.4


def test_a_planned_thrust_that_goes_on_is_warned_of_and_once_only() -> None:
    normal = _kept(_loads((5, 5000, 5000), (1.7, 5000, 0), (4, 0, 0)))
    plan = _thrust((5, 0, 0), (1.7, 0, 20400), (4, 20400, 20400), rising_until_s=6.7)
    ((foot, t),) = raised(looked_at(normal, plan), NUMBERS)
    assert foot == 0 and 6.0 < t < 6.5  # 300 N at 6.6 s


def test_a_scene_knows_its_plan_again() -> None:
    loads = {kind: _kept(_loads((10, 5000, 5000))) for kind in KEPT}
    scene = {"scene": vars(Scene("losses", "tuning", 0, 10.0)), "off": [], "losses": []}
    found = outcomes(scene, loads)
    assert {"own", "true", "unplanned", "curve"} == set(found)
    assert all(
        found[word]["false"] == 0 and found[word]["leads_s"] == []
        for word in ("own", "true", "unplanned")
    )


def test_every_number_is_judged_on_kept_scenes_with_its_neighbours(tmp_path: Path) -> None:
    """One foot falls at 3 kN/s in a scene of 10 s and is warned of in time; then nothing can be judged."""
    normal = _loads((5, 5000, 5000), (1.6, 5000, 200), (3.4, 0, 0))
    carrying = np.ones(normal.shape, dtype=bool)
    losses = [vars(loss) for loss in find_losses(normal, carrying, DT, 2.0)]
    tree = {
        "scene": vars(Scene("quiet", "tuning", 1, 10.0)),
        "off": off_ground(normal, carrying, DT),
        "losses": losses,
    }
    tree["loads"] = packed(dict.fromkeys(KEPT, means(normal, DT)))
    (tmp_path / LINES).write_text(json.dumps({"case": "a", "mark": "", "answer": tree}) + "\n")
    rows = list(report(tmp_path, "tuning"))
    assert len(rows) == 3 + 2 * (len(NUMBERS) - 1)
    assert rows[0].split() == [
        "as",
        "it",
        "is",
        "1.000",
        "of",
        "1",
        "right",
        "1.000",
        "of",
        "1",
        "in",
        "time",
    ]
    with pytest.raises(InputError, match="holds no scenes"):
        list(report(tmp_path, "scoring"))


def test_marks_add_up_what_the_scenes_say() -> None:
    one = {
        "lost": 3,
        "early": 1,
        "near": 1,
        "false": 0,
        "late": 2,
        "light": 1,
        "light_lost": 1,
        "leads_s": [0.1, 0.05],
    }
    two = {
        "lost": 0,
        "early": 0,
        "near": 0,
        "false": 1,
        "late": 0,
        "light": 0,
        "light_lost": 0,
        "leads_s": [0.3],
    }
    found = marks([one, two])
    assert found["warnings"] == 5 and found["precision"] == pytest.approx(0.6)
    assert found["warned_100_ms_ahead"] == pytest.approx(2 / 3) and found[
        "lead_median_s"
    ] == pytest.approx(0.1)
    assert found["early"] == 1 and found["precision_of_early"] == pytest.approx(1 / 3)


def test_kept_loads_are_means_of_five_milliseconds_and_come_back_in_newtons() -> None:
    values = np.repeat(np.arange(12.0)[:, None] * 100.0, 4, axis=1)
    assert means(values, DT)[:, 0].tolist() == [200 / 5, 700 / 5]
    kinds = {kind: means(values + 1000.0 * k, DT) for k, kind in enumerate(KEPT)}
    back = unpacked(packed(kinds))
    assert list(back) == list(KEPT)
    assert back[KEPT[2]][:, 3].tolist() == [2200.0, 2700.0]
