"""The valve's command against the motion: oil that flows in moves the piston out, at the orifice's
speed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.recording.checker.flow import LATEST_S, check_flow
from testbed.recording.checker.motion import Even
from testbed.recording.known import Known

RATE_HZ = 500.0
DROP_PA, RATED_M3_S, SUPPLY_PA = 3.5e6, 4.0e-4, 1.6e7
KNOWN = Known(
    bore_m=0.08,
    rod_m=0.045,
    supply_pressure_nominal_pa=SUPPLY_PA,
    valve_rated_flow_m3_s=RATED_M3_S,
    valve_rated_drop_per_edge_pa=DROP_PA,
    valve_deadband=0.1,
)


def moved(sign: float = 1.0, scale: float = 1.0, late_s: float = 0.04) -> Even:
    """A piston that does what the orifices let through, `late_s` after the command."""
    t = np.arange(0.0, 12.0, 1.0 / RATE_HZ)
    command = np.where(np.sin(2.0 * np.pi * 0.4 * t) > 0.0, 0.55, -0.4)
    opening = np.sign(command) * (np.abs(command) - 0.1) / 0.9
    pressure_a, pressure_b = np.full_like(t, 5.0e6), np.full_like(t, 3.0e6)
    out = np.sqrt((SUPPLY_PA - pressure_a) / DROP_PA) / KNOWN.area_a_m2
    back = np.sqrt((SUPPLY_PA - pressure_b) / DROP_PA) / KNOWN.area_b_m2
    speed = RATED_M3_S * opening * np.where(opening > 0.0, out, back)
    late = round(late_s * RATE_HZ)
    answer = scale * sign * np.concatenate([np.zeros(late), speed[: len(speed) - late]])
    series = {"command": command, "pressure_a": pressure_a, "pressure_b": pressure_b}
    return Even(RATE_HZ, answer, np.zeros_like(t), series)


@pytest.mark.parametrize("late_s", [0.0, 0.02, 0.08])
def test_a_valve_that_moves_its_piston_as_it_should_is_no_finding(late_s: float) -> None:
    assert list(check_flow(moved(late_s=late_s), KNOWN, "valve")) == []


def test_a_piston_that_runs_against_its_valve_has_a_sign_turned_round() -> None:
    (finding,) = check_flow(moved(sign=-1.0), KNOWN, "valve")
    assert finding.severity == "error" and finding.channel == "valve"
    assert "turned round" in finding.what


@pytest.mark.parametrize("scale", [1e3, 0.05])
def test_a_position_in_another_unit_moves_at_another_scale_than_the_oil(scale: float) -> None:
    (finding,) = check_flow(moved(scale=scale), KNOWN, "valve")
    assert finding.channel == "position" and "another scale" in finding.what
    ratio = float(finding.evidence.split()[0])
    assert ratio == pytest.approx(scale, rel=0.02)


def test_a_worn_valve_is_no_wrong_unit() -> None:
    assert list(check_flow(moved(scale=0.5), KNOWN, "valve")) == []


def test_without_the_valves_flow_only_the_sign_can_be_told() -> None:
    bare = Known(bore_m=0.08, rod_m=0.045)
    assert list(check_flow(moved(scale=1e3), bare, "valve")) == []
    assert len(list(check_flow(moved(sign=-1.0), bare, "valve"))) == 1


def test_a_motion_that_has_nothing_to_do_with_the_command_tells_nothing() -> None:
    even = moved()
    other = 0.2 * np.sin(2.0 * np.pi * 7.3 * np.arange(len(even.speed_m_s)) / RATE_HZ)
    drifting = Even(RATE_HZ, other, even.acceleration_m_s2, even.series)
    assert list(check_flow(drifting, KNOWN, "valve")) == []


def test_an_answer_as_late_as_the_slowest_spool_is_still_found() -> None:
    """Later still it would seem to run against the command; within LATEST_S it does not."""
    assert list(check_flow(moved(late_s=0.9 * LATEST_S), KNOWN, "valve")) == []


def test_a_recording_without_a_command_is_not_judged() -> None:
    even = moved()
    without = {name: values for name, values in even.series.items() if name != "command"}
    bare = Even(RATE_HZ, -even.speed_m_s, even.acceleration_m_s2, without)
    assert list(check_flow(bare, KNOWN, "valve")) == []


def test_a_free_piston_that_hardly_moves_while_oil_flows_in_has_another_scale() -> None:
    (finding,) = check_flow(moved(scale=1e-3), KNOWN, "valve_command")
    assert (finding.severity, finding.channel) == ("error", "position")
    pressed = moved(scale=1e-3)
    pressed = replace(
        pressed, series={**pressed.series, "reference": np.ones(pressed.speed_m_s.size)}
    )
    assert list(check_flow(pressed, KNOWN, "valve_command")) == []
