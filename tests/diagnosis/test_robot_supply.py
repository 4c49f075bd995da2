"""The supply of the whole robot: what a load-sensing pump is asked for, how a line follows it, and
what ropes that are hauled ask beside the cylinders.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from testbed.diagnosis.robot.bins import Bins, Frame, bins_of
from testbed.diagnosis.robot.hauling import ROPE_M, Hauling, hauling_of
from testbed.diagnosis.robot.oil import Oil, oil_of
from testbed.diagnosis.robot.supply import RETURNED, RETURNED_SD, Supply, supply_of
from testbed.effects import by_name
from testbed.machine.build import build_machine
from testbed.machine.model import Machine
from testbed.machine.names import AXES
from testbed.machine.scale import ROBOCLIMBER
from testbed.robot.robot import Robot

Array = npt.NDArray[np.float64]
LOAD_PA, LOW_PA = 4.0e6, 1.0e6
ROPES = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
TENSION_N = 1.0e4


def still(command: Array, supply_pa: Array | float = 0.0) -> tuple[list[Oil], Bins, Frame, Robot]:
    """A robot whose joints and pressures do not move, the first valve at `command` (750,)."""
    t = np.arange(750) / 250.0
    data = {"t": t, "supply_pressure": 0 * t + supply_pa, "oil_temperature": 0 * t + 40.0}
    for axis in AXES:
        data[f"position_{axis}"] = 0 * t + (0.0 if axis.endswith("rotation") else 0.2)
        data[f"pressure_a_{axis}"] = 0 * t + LOW_PA
        data[f"pressure_b_{axis}"] = 0 * t + LOW_PA
        data[f"valve_{axis}"] = 0 * t
    data[f"valve_{AXES[0]}"], data[f"pressure_a_{AXES[0]}"] = command, 0 * t + LOAD_PA
    for side in ("left", "right"):
        data[f"rope_tension_{side}"] = 0 * t + TENSION_N
    for angle in ("roll", "pitch", "yaw"):
        data[f"attitude_{angle}"] = 0 * t
    for way, lift in zip("xyz", (0.0, 0.0, 9.81), strict=True):
        data[f"specific_force_{way}"] = 0 * t + lift
        data[f"angular_rate_{way}"] = 0 * t
    data["ordered_thrust"] = data["ordered_torque"] = 0 * t
    body, frame = Robot.of(build_machine()), Frame.of(t)
    bins = bins_of(data, body)
    return list(oil_of(data, bins, frame, body)), bins, frame, body


def believed(command: Array, supply_pa: Array | float, hauling: Hauling | None = None) -> Supply:
    """The supply's group of such a recording."""
    oils, bins, frame, body = still(command, supply_pa)
    return supply_of(oils, bins, frame, body.machine, hauling or Hauling.none(bins.count))


def giving(body: Robot, full_flow_m3_s: float) -> Machine:
    """The robot's machine with a pump that gives so much at most."""
    unit = body.machine.power_unit.model_copy(update={"full_flow_m3_s": full_flow_m3_s})
    return body.machine.model_copy(update={"power_unit": unit})


def test_a_load_sensing_pump_stands_its_margin_above_the_load_behind_an_open_port() -> None:
    unit = build_machine().power_unit
    expected = LOAD_PA + unit.load_sensing_margin_pa
    supply = believed(np.full(750, 0.3), expected)
    sag = unit.compensator_band_pa * supply.drawn_m3_s / unit.full_flow_m3_s
    assert supply.missing == pytest.approx(-sag, abs=0.01 * expected)


def test_with_every_port_shut_it_stands_at_its_standby_pressure() -> None:
    standby = build_machine().power_unit.standby_pressure_pa
    assert believed(np.zeros(750), standby).missing == pytest.approx(0.0, abs=1.0)


def test_the_line_fills_at_once_and_empties_as_it_leaks() -> None:
    opened = np.where(np.arange(750) < 375, 0.0, 0.3)
    up, down = believed(opened, 0.0).missing, believed(opened[::-1], 0.0).missing
    middle = 0.5 * (up[0] + up[-1])
    half = int(np.argmax(up > middle))
    rising = np.argmax(up > 0.95 * up[-1]) - np.argmax(up > 1.05 * up[0])
    falling = np.argmax(down < 1.05 * down[-1]) - np.argmax(down < 0.95 * down[0])
    assert 0 < half < len(up) - 1
    assert falling > rising


def test_a_pump_that_is_set_too_low_lacks_what_it_is_asked_for_beyond() -> None:
    unit = build_machine().power_unit
    low = 0.6 * unit.supply_pressure_pa
    supply = believed(np.full(750, 0.3), low)
    rest = supply.missing - (1.0 - 0.6) * supply.by_pressure
    assert supply.missing.min() > 0.0
    assert np.abs(rest).max() < 0.3 * np.abs(supply.missing).max()


@pytest.mark.parametrize("gives", [0.6, 0.8])
def test_a_weak_pump_stands_where_open_valves_take_no_more_than_it_gives(gives: float) -> None:
    pressure = LOAD_PA + 0.3e6
    oils, bins, frame, body = still(np.full(750, 0.6), pressure)
    drawn = believed(np.full(750, 0.6), pressure).drawn_m3_s.mean()
    machine = giving(body, float(drawn) / gives)
    supply = supply_of(oils, bins, frame, machine, Hauling.none(bins.count))
    sound = 0.3e6 / gives**2  # the drop at which the same valves take all that a sound pump gives
    assert supply.missing == pytest.approx(sound - 0.3e6, rel=0.1)
    assert (1.0 - gives) * supply.by_flow == pytest.approx(supply.missing, rel=0.15)


def test_a_sound_pump_that_is_asked_for_all_it_gives_stands_where_valves_take_no_more() -> None:
    pressure = LOAD_PA + 0.3e6
    oils, bins, frame, body = still(np.full(750, 0.6), pressure)
    drawn = believed(np.full(750, 0.6), pressure).drawn_m3_s.mean()
    machine = giving(body, float(drawn))
    supply = supply_of(oils, bins, frame, machine, Hauling.none(bins.count))
    assert machine.power_unit.load_sensing_margin_pa > 0.8e6
    assert supply.missing == pytest.approx(0.0, abs=0.02e6)


def test_a_supply_that_gives_way_stands_lower_by_its_droop_of_the_flow() -> None:
    unit = build_machine().power_unit
    asked = LOAD_PA + unit.load_sensing_margin_pa
    droop = 3.0e9
    pressure = asked
    for _ in range(8):  # what valves draw falls with the pressure that they are given
        pressure = asked - droop * believed(np.full(750, 0.3), pressure).drawn_m3_s.mean()
    supply = believed(np.full(750, 0.3), pressure)
    sag = unit.compensator_band_pa * supply.drawn_m3_s / unit.full_flow_m3_s
    assert droop * supply.by_droop[:, 0] == pytest.approx(supply.missing + sag, rel=0.02)


def test_a_droop_takes_nothing_from_valves_that_take_all_that_the_pump_gives() -> None:
    pressure = LOAD_PA + 0.3e6
    oils, bins, frame, body = still(np.full(750, 0.6), pressure)
    drawn = believed(np.full(750, 0.6), pressure).drawn_m3_s.mean()
    machine = giving(body, float(drawn))
    scarce, ample = (
        supply_of(oils, bins, frame, m, Hauling.none(bins.count)).by_droop
        for m in (machine, body.machine)
    )
    assert scarce == pytest.approx(0.0, abs=1e-3 * drawn)
    assert ample.min(axis=0) == pytest.approx(drawn, rel=0.05)


def test_ropes_that_are_hauled_ask_for_their_load_and_perhaps_when_the_body_hardly_moves() -> None:
    oils, bins, frame, body = still(np.zeros(750))
    area = body.machine.traction.piston_area_m2
    rises = replace(bins, tension_n=TENSION_N + 2.0e4 * bins.time_s[:, None] * np.ones(2))
    hauling, calm = hauling_of(rises, body, ROPES), hauling_of(bins, body, ROPES)
    speed = ROPE_M / body.machine.rope.stiffness_ea_n * 2.0e4
    assert hauling.drawn_m3_s == pytest.approx(2.0 * area * speed, rel=1e-6)
    assert hauling.load_pa == pytest.approx(rises.tension_n[:, 0] / area)
    assert not calm.load_pa.any() and calm.unsure == pytest.approx(1.0)
    quiet = supply_of(oils, bins, frame, body.machine, Hauling.none(bins.count))
    hauled = supply_of(oils, rises, frame, body.machine, hauling)
    more = hauled.missing - quiet.missing
    unit = body.machine.power_unit
    asked = np.minimum(hauling.load_pa + unit.load_sensing_margin_pa, unit.supply_pressure_pa)
    assert more[5:-5] == pytest.approx(asked[5:-5] - unit.standby_pressure_pa, rel=0.1)


def jumped(bins: Bins, bin_s: float) -> Bins:
    """The bins with the left rope's tension risen by half at once, at this time."""
    rises = 0.5 * TENSION_N * (bins.time_s > bin_s)
    return replace(bins, tension_n=bins.tension_n + rises[:, None] * [1.0, 0.0])


def test_a_device_that_changes_its_grip_may_draw_its_way_back_until_that_is_over() -> None:
    _, bins, _, body = still(np.zeros(750))
    traction = body.machine.traction.model_copy(update={"stroke_m": 0.06, "clamp_s": 0.1})
    machine = body.machine.model_copy(update={"traction": traction})
    quick = replace(body, machine=machine)
    lasts_s = 0.06 / traction.return_speed_m_s + 2.0 * 0.1
    back = hauling_of(jumped(bins, 1.0), quick, ROPES).returning_m3_s
    one = traction.annulus_area_m2 * traction.return_speed_m_s
    after = bins.time_s - 1.0
    assert back[(after > 0.1) & (after < lasts_s)] == pytest.approx(one)
    assert not back[(after < -0.6) | (after > lasts_s + 0.8)].any()
    assert not hauling_of(bins, quick, ROPES).returning_m3_s.any()


class WideOpen:
    """A robot of which one valve takes all that it can, and whose devices may go back from 1 s on:
    `drawn` by cylinders and `back` by devices, m3/s.
    """

    def __init__(self) -> None:
        command, pressure = np.full(750, 0.6), LOAD_PA + 0.3e6
        self.oils, self.bins, self.frame, self.body = still(command, pressure)
        traction = self.body.machine.traction
        self.back = traction.annulus_area_m2 * traction.return_speed_m_s
        self.drawn = float(believed(command, pressure).drawn_m3_s.mean())

    def supply(self, full_flow_m3_s: float, *, goes_back: bool = True) -> Supply:
        """Of a pump that gives so much at most."""
        tension = jumped(self.bins, 1.0) if goes_back else self.bins
        hauling = hauling_of(tension, self.body, ROPES)
        return supply_of(
            self.oils, self.bins, self.frame, giving(self.body, full_flow_m3_s), hauling
        )


def test_a_pump_that_devices_on_their_way_back_may_ask_for_all_it_gives_is_not_known() -> None:
    robot = WideOpen()
    later = robot.bins.time_s > 2.0

    def unsure(full_flow_m3_s: float, goes_back: bool) -> Array:
        noise = robot.supply(full_flow_m3_s, goes_back=goes_back).noise
        return np.sqrt(np.diag(noise))[later]

    whole = robot.drawn + robot.back
    tight, ample = (unsure(flow, True) / unsure(flow, False) for flow in (whole, 2.0 * whole))
    assert tight.min() > 5.0
    assert ample == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("share", [RETURNED - RETURNED_SD, RETURNED + RETURNED_SD])
def test_devices_that_go_back_as_often_as_is_taken_are_no_weak_pump(share: float) -> None:
    robot = WideOpen()
    later = robot.bins.time_s > 2.0
    as_taken, more_or_less = (
        robot.supply(robot.drawn + part * robot.back) for part in (RETURNED, share)
    )
    assert as_taken.missing[later] == pytest.approx(0.0, abs=0.02e6)
    missing = np.abs(more_or_less.missing[later])
    assert missing.max() > 0.1e6
    assert np.all(missing < 2.01 * more_or_less.by_returning[later])


def test_devices_that_go_back_less_often_than_is_taken_are_no_supply_that_gives_way() -> None:
    """It stands higher than is believed then, and no droop makes it so."""
    robot = WideOpen()
    supply = robot.supply(robot.drawn + 0.1 * robot.back)
    assert supply.missing.min() < -0.1e6
    assert supply.by_droop.min() >= 0.0


@pytest.mark.parametrize(("share", "is_one"), [(0.2, False), (0.5, True), (3.0, True)])
def test_a_supply_that_hardly_gives_way_is_no_droop_in_whatever_times_it_does(
    share: float, is_one: bool
) -> None:
    droop = by_name("supply.droop")
    parts = share * droop.spread("droop 0") * np.array([[0.3, -0.2, 0.9], [1.0, 0.0, 0.0]])
    numbers = {f"droop {k}": parts[:, k] for k in range(3)}
    assert (droop.possible(numbers, ROBOCLIMBER) == is_one).all()
    linear = {name: float(values[0]) for name, values in numbers.items()}
    size = droop.from_linear(linear, None, "supply")["droop"]  # type: ignore[arg-type]
    assert size == pytest.approx(share * droop.usual)
