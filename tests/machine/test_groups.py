"""What a machine's numbers may be, and what follows from them."""

from __future__ import annotations

import math
from typing import Any

import pytest
from pydantic import ValidationError
from shipped import MACHINE

from testbed.machine.groups import Cylinder, PowerUnit, Sensor, Valve


def changed(group: Any, **numbers: float) -> Any:
    """The shipped group with other numbers, checked anew."""
    return type(group).model_validate(group.model_dump() | numbers)


CYLINDER: Cylinder = MACHINE.axes["fl_vertical"].cylinder
SENSOR: Sensor = MACHINE.axes["fl_vertical"].sensor
UNIT: PowerUnit = MACHINE.power_unit
VALVE: Valve = MACHINE.axes["fl_vertical"].valve


def test_a_rod_as_wide_as_its_bore_is_impossible() -> None:
    assert changed(CYLINDER, rod_m=0.99 * CYLINDER.bore_m).rod_m == 0.99 * CYLINDER.bore_m
    with pytest.raises(ValidationError, match=r"rod_m\n.*is impossible"):
        changed(CYLINDER, rod_m=CYLINDER.bore_m)


def test_a_supply_below_its_tank_is_impossible() -> None:
    with pytest.raises(ValidationError, match=r"supply_pressure_pa\n.*is impossible"):
        changed(UNIT, tank_pressure_pa=2.0e5, supply_pressure_pa=2.0e5)


@pytest.mark.parametrize("kind", [0.5, 3.0, -1.0])
def test_a_kind_is_one_of_three(kind: float) -> None:
    with pytest.raises(ValidationError, match="is no kind"):
        changed(UNIT, supply_kind=kind)


def test_what_a_supply_stands_at_goes_by_its_kind() -> None:
    constant = changed(UNIT, supply_kind=0.0)
    sensing = changed(UNIT, supply_kind=1.0)
    assert not constant.load_sensing and constant.ready_pressure_pa == UNIT.supply_pressure_pa
    assert sensing.load_sensing and sensing.ready_pressure_pa == UNIT.standby_pressure_pa


@pytest.mark.parametrize("joint", ["vertical", "radial", "rotation"])
def test_every_joint_has_valves_of_its_own_size(joint: str) -> None:
    other = changed(VALVE, **{f"rated_flow_{joint}_m3_s": 1.25e-4})
    assert other.rated_flow_m3_s(joint) == 1.25e-4


def test_a_transducers_accuracy_is_its_bow_evenly_drawn_and_its_loop() -> None:
    bow = changed(SENSOR, pressure_linearity_pa=3.0e4, pressure_hysteresis_pa=0.0)
    assert bow.pressure_accuracy_pa == pytest.approx(3.0e4 / math.sqrt(3.0))
    loop = changed(SENSOR, pressure_linearity_pa=0.0, pressure_hysteresis_pa=1.0e4)
    assert loop.pressure_accuracy_pa == pytest.approx(6.0e3)  # half of 0.2 and 1 times the loop
    both = changed(SENSOR, pressure_linearity_pa=3.0e4, pressure_hysteresis_pa=1.0e4)
    assert both.pressure_accuracy_pa**2 == pytest.approx(
        bow.pressure_accuracy_pa**2 + loop.pressure_accuracy_pa**2
    )


@pytest.mark.parametrize(
    ("group", "number", "value"),
    [
        (CYLINDER, "bore_m", 0.0),
        (CYLINDER, "coulomb_out_n", -1.0),
        (CYLINDER, "stribeck_in_m_s", 0.0),
        (VALVE, "deadband", 1.0),
        (VALVE, "natural_frequency_hz", 0.0),
        (UNIT, "accumulator_volume_m3", -1e-3),
        (SENSOR, "thermal_span_share", 0.6),
        (SENSOR, "pressure_range_pa", float("nan")),
    ],
)
def test_a_number_that_no_part_can_have_is_refused(group: Any, number: str, value: float) -> None:
    with pytest.raises(ValidationError, match=number):
        changed(group, **{number: value})


def test_a_number_that_does_not_exist_is_refused() -> None:
    with pytest.raises(ValidationError, match="bore_mm"):
        changed(CYLINDER, bore_mm=80.0)
