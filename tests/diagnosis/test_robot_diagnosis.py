"""One leg of four: an effect acts at its place alone, the open diagonal is nobody's, a gain is named with its leg."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from testbed.diagnosis.leg.fit import residuals
from testbed.diagnosis.leg.points import Point
from testbed.diagnosis.leg.series import series_of
from testbed.diagnosis.robot.diagnose import diagnose_robot
from testbed.diagnosis.robot.findings import as_json, write_findings
from testbed.diagnosis.robot.problem import DIAGONAL, RobotProblem
from testbed.diagnosis.robot.rig import (
    believed_model,
    known_of,
    recordings_of,
    through_amplifier,
)
from testbed.effects import by_name, kind_of, place_of
from testbed.effects.base import Active
from testbed.errors import InputError
from testbed.estimation.leg.flow import Edge
from testbed.estimation.live.believed import Believed
from testbed.machine.build import build_machine
from testbed.machine.names import LEGS
from testbed.recording.leg_model import read_model

Array = npt.NDArray[np.float64]
MACHINE = build_machine()


def standing(
    seconds: float = 8.0, rate_hz: float = 250.0, gains: dict[str, float] | None = None
) -> dict[str, Array]:
    """A robot at rest on level ground: 10 kN a leg carried by the pressures, friction nowhere, sensors with noise."""
    rng = np.random.default_rng(3)
    t = np.arange(round(seconds * rate_hz)) / rate_hz
    known = known_of(
        {"attitude_pitch": 0 * t, "attitude_roll": 0 * t, "supply_pressure": 0 * t + 1.8e6}, MACHINE
    )
    back = 2.3e5  # chamber B has drained
    weight = (known.moving_mass_kg or 0.0) * 9.81
    carrying = (1e4 - weight + back * known.area_b_m2) / known.area_a_m2
    data = {
        "t": t,
        "attitude_pitch": 0 * t,
        "attitude_roll": 0 * t,
        "supply_pressure": 0 * t + 1.8e6,
    }
    for leg in LEGS:
        slow = 1e4 + 3000.0 * np.sin(2.0 * t)
        data[f"expected_{leg}"] = slow
        measured = (carrying + (slow - 1e4) / known.area_a_m2) * (1.0 + (gains or {}).get(leg, 0.0))
        data[f"pressure_a_{leg}_vertical"] = measured + 8e3 * rng.standard_normal(len(t))
        data[f"pressure_b_{leg}_vertical"] = back + 8e3 * rng.standard_normal(len(t))
        data[f"position_{leg}_vertical"] = 0.25 + 0.0 * t
        data[f"valve_{leg}_vertical"] = 0.0 * t
    return data


def test_a_name_with_a_place_is_split_and_its_effect_acts_there_alone() -> None:
    name = "sensor.gain_a@fl_vertical"
    assert (kind_of(name), place_of(name)) == ("sensor.gain_a", "fl_vertical") and place_of(
        "sensor.gain_a"
    ) is None
    series = series_of(recordings_of(standing(2.0), MACHINE, Path("run")))
    gain = Active(by_name(name), {"gain_error": 0.25, "bend": 0.0})
    for s in series:
        right = gain.correct(s.signals).pressure_a_pa
        share = 0.8 if s.name == "fl_vertical" else 1.0
        assert right is not None and s.signals.pressure_a_pa is not None
        np.testing.assert_allclose(right, share * s.signals.pressure_a_pa)


def test_a_force_on_one_leg_shows_three_quarters_there_and_a_quarter_elsewhere() -> None:
    """r - d (d . r) of r = (e, 0, 0, 0) is e (3/4, 1/4, 1/4, -1/4)."""
    recordings = recordings_of(standing(2.0), MACHINE, Path("run"))
    model = believed_model(recordings[0].known, MACHINE)
    problem = RobotProblem(series_of(recordings), model, True)
    spring = by_name("force.spring@fl_vertical")
    push = Active(
        spring, spring.complete({"stiffness": -40_000.0, "rest": 0.0})
    )  # 10 kN at 0.25 m, outwards
    at = [Point(model.friction, Edge(), effects) for effects in ((), (push,))]
    without, pushed = (
        residuals(problem, p, ("force",))["force"].reshape(4, -1).mean(axis=1) for p in at
    )
    change = pushed - without
    np.testing.assert_allclose(change / change[0], [1.0, 1 / 3, 1 / 3, -1 / 3], rtol=1e-6)
    assert abs(DIAGONAL @ pushed) < 1e-6 * abs(change[0])


def test_the_declared_play_holds_a_command_back_by_its_half_width() -> None:
    time = np.arange(2000) / 1000.0
    triangle = 0.1 * np.abs(((time / 0.5) % 2.0) - 1.0)
    out = through_amplifier(triangle, time, MACHINE.valve)
    half, lag = MACHINE.valve.hysteresis, 0.2 * MACHINE.valve.amplifier_lag_s
    rising = (time > 0.7) & (time < 0.95)
    np.testing.assert_allclose(triangle[rising] - out[rising], half + lag, atol=2.1e-4)


@pytest.mark.slow
def test_a_wrong_gain_is_named_with_its_leg_and_the_model_believes_it(tmp_path: Path) -> None:
    found = diagnose_robot("standing", standing(gains={"rl": -0.12}), MACHINE, tmp_path)
    said = as_json(found)
    assert said["verdict"] == "effect"
    assert [(e["name"], e["place"]) for e in said["effects"]] == [("sensor.gain_a", "rl_vertical")]
    assert found.errors["rl_vertical"]["after"] < 0.2 * found.errors["rl_vertical"]["refit"]
    write_findings(found, tmp_path)
    assert json.loads((tmp_path / "findings.json").read_text())["effects"] == said["effects"]
    model = read_model(tmp_path / "model.yaml")
    legs = dict(zip(LEGS, Believed.from_model(model, 1e-3, MACHINE).legs, strict=True))
    assert legs["rl"].gain_a == pytest.approx(
        said["effects"][0]["parameters"]["gain_error"]["value"]
    )
    assert legs["fl"].gain_a == 0.0
    again = diagnose_robot(
        "standing", standing(gains={"rl": -0.12}), MACHINE, tmp_path, start=model
    )
    assert as_json(again)["verdict"] == "none" and as_json(again)["effects"] == []


def test_a_sound_robot_at_rest_is_left_alone_and_friction_is_no_hypothesis(tmp_path: Path) -> None:
    said = as_json(diagnose_robot("standing", standing(), MACHINE, tmp_path))
    assert said["verdict"] == "none" and said["effects"] == []
    assert {"name": "friction.load", "reason": "no piston slides in this run"} in said["left_out"]


def test_a_missing_column_is_named(tmp_path: Path) -> None:
    data = standing(2.0)
    del data["pressure_b_rr_vertical"]
    with pytest.raises(InputError, match="pressure_b_rr_vertical"):
        diagnose_robot("standing", data, MACHINE, tmp_path)
