"""The oil of the robot's cylinders: what goes through the edges that a check valve lets through."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from testbed.diagnosis.robot.bins import Frame, bins_of
from testbed.diagnosis.robot.oil import WRONG_PA, Oil, oil_of
from testbed.diagnosis.robot.oil_evidence import SEEPS_M3_S, expected, tolerated
from testbed.diagnosis.robot.valve_edges import root
from testbed.laws.holding import NO_HOLDING
from testbed.machine.build import build_machine
from testbed.machine.names import AXES
from testbed.machine.scale import ROBOCLIMBER
from testbed.robot.robot import Robot

Array = npt.NDArray[np.float64]
PRESSURE_A_PA, PRESSURE_B_PA = 3e6, 2e6
WARM_DEGC = 40.0
"""At which leakages are declared."""


def held_still(command: float, pressure_a_pa: float = PRESSURE_A_PA, **valve: float) -> Oil:
    """The first cylinder's oil while its valve is held at `command`, pressures and joints still;
    `valve`: numbers of all valves.
    """
    t = np.arange(750) / 250.0
    data = {"t": t, "supply_pressure": 0 * t + 9e6, "oil_temperature": 0 * t + WARM_DEGC}
    for axis in AXES:
        data[f"position_{axis}"] = 0 * t + (0.0 if axis.endswith("rotation") else 0.2)
        data[f"pressure_a_{axis}"] = 0 * t + pressure_a_pa
        data[f"pressure_b_{axis}"] = 0 * t + PRESSURE_B_PA
        data[f"valve_{axis}"] = 0 * t + command
    for side in ("left", "right"):
        data[f"rope_tension_{side}"] = 0 * t + 1e4
    for angle in ("roll", "pitch", "yaw"):
        data[f"attitude_{angle}"] = 0 * t
    for way, lift in zip("xyz", (0.0, 0.0, 9.81), strict=True):
        data[f"specific_force_{way}"] = 0 * t + lift
        data[f"angular_rate_{way}"] = 0 * t
    data["ordered_thrust"] = data["ordered_torque"] = 0 * t
    numbers = {f"valve.{name}": value for name, value in valve.items()}
    robot = Robot.of(build_machine(numbers))
    return oil_of(data, bins_of(data, robot), Frame.of(t), robot)[0]


def leaving_to_tank(oil: Oil) -> float:
    """Flow from chamber A to the tank by 1 m3/(s Pa) of leakage of that edge."""
    return float(np.mean(oil.by_edge_leak[:, 0, 1]))


@pytest.mark.parametrize("command", [0.3, -0.3])
def test_an_edge_leaks_past_a_check_valve_that_feeds_or_is_drawn_open(command: float) -> None:
    drop_pa = PRESSURE_A_PA - build_machine().power_unit.tank_pressure_pa
    assert leaving_to_tank(held_still(command)) == pytest.approx(drop_pa, rel=1e-6)


def test_a_shut_check_valve_is_tight() -> None:
    assert leaving_to_tank(held_still(0.0)) == 0.0


@pytest.mark.parametrize(("setting_pa", "share"), [(1e6, 1.0), (9e6, 0.0), (7.7e6, 0.5)])
def test_a_counterbalance_valve_lets_out_what_own_and_other_pressure_open_it_for(
    setting_pa: float, share: float
) -> None:
    # 28 bar over the tank's at A and three times 18 at B against the setting; open 10 bar above it.
    held = held_still(-0.3, holding_a=2.0, counterbalance_setting_pa=setting_pa)
    checked = held_still(-0.3)
    assert held.to_tank[:, 0] == pytest.approx(share * checked.to_tank[:, 0])
    assert np.all(checked.to_tank[:, 0] < 0.0)


@pytest.mark.parametrize("drop_pa", [1e3, 3e4, 2.8e6])
def test_a_sensor_that_reads_wrong_tells_another_root_and_not_the_slope_at_what_it_reads(
    drop_pa: float,
) -> None:
    tank_pa = build_machine().power_unit.tank_pressure_pa
    oil = held_still(-0.3, tank_pa + drop_pa, holding_a=NO_HOLDING)
    more, less, read = root(np.array([drop_pa + WRONG_PA, drop_pa - WRONG_PA, drop_pa]))
    told = oil.by_wrong_reading[:, 0] * read / oil.to_tank[:, 0]
    assert told == pytest.approx(0.5 * (more - less) / WRONG_PA, rel=1e-6)


def test_the_slope_at_no_drop_says_many_times_what_a_wrong_reading_makes() -> None:
    tank_pa = build_machine().power_unit.tank_pressure_pa
    oil = held_still(-0.3, tank_pa, holding_a=NO_HOLDING)
    assert np.all(oil.by_reading[:, 0] / oil.by_wrong_reading[:, 0] > 3.0)


def test_sound_machines_have_the_air_of_workshops_not_of_the_drawing() -> None:
    """Half to two and a half times what is drawn: half of it more in the mean."""
    oil, axis = held_still(0.0), build_machine().axes[AXES[0]]
    nothing, one = np.zeros_like(oil.missing), np.ones_like(oil.missing)
    airy = replace(oil, by_air=one, by_leak=nothing, by_softness=nothing)
    np.testing.assert_allclose(expected(airy, axis), 0.5 * axis.oil.entrained_air)


def test_a_little_may_seep_into_either_chamber_of_a_sound_machine() -> None:
    oil, axis = held_still(0.0), build_machine().axes[AXES[0]]
    alike = [c * sd for c, sd in tolerated(oil, axis, ROBOCLIMBER) if sd == SEEPS_M3_S]
    assert [column.any(axis=0).tolist() for column in alike] == [[True, False], [False, True]]
    assert all(column.max() == SEEPS_M3_S for column in alike)
