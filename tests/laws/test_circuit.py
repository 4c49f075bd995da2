"""Load-holding valves and kinds of supply: what passes when, and what the pump works towards."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from testbed.laws.axis_records import AxisInput, AxisState, ChamberParameters, ChamberWork
from testbed.laws.holding import (
    COUNTERBALANCE,
    COUNTERBALANCE_BAND_PA,
    NO_HOLDING,
    PILOT_CHECK,
    held_port,
)
from testbed.laws.hydraulics import hydraulic_step, sensed_load
from testbed.laws.initial import start_axes, start_supply
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.laws.orifice import PortFlow, port
from testbed.laws.supply import (
    LOAD_SENSING,
    UNLOADING,
    PowerUnit,
    SupplyState,
    demand_step,
    wanted_stroke,
)
from testbed.machine.build import build_machine
from testbed.world.hydraulic_parameters import axis_parameters, unit_parameters

TANK, SUPPLY = 1.0e5, 9.0e6


def held(kind: float, p: float, opening: float, pilot: float = 1e5) -> PortFlow:
    """A port with a load-holding valve at pressure p."""
    chamber = ChamberParameters.of(from_supply=2e-7, to_tank=2e-7)
    chamber.holding.kind, chamber.holding.setting, chamber.holding.pilot_ratio = kind, 6.0e6, 3.0
    leaks = ChamberWork.of(leak_from_supply=1e-13, leak_to_tank=3e-13)
    flow = port(p, SUPPLY, TANK, chamber, leaks, opening, opening)
    return held_port(flow, p, pilot, TANK, chamber, opening < 0.0)


def test_no_oil_leaks_past_a_shut_holding_valve() -> None:
    assert held(PILOT_CHECK, 5e6, 0.0) == held(COUNTERBALANCE, 5e6, 0.0) == PortFlow(*[0.0] * 6)
    loose = held(NO_HOLDING, 5e6, 0.0)
    assert loose.supply + loose.tank == pytest.approx(1e-13 * 4e6 - 3e-13 * 4.9e6)


def test_a_load_above_the_supply_is_held_though_the_spool_opens_to_it() -> None:
    assert held(PILOT_CHECK, 9.5e6, 0.5).supply == 0.0
    assert held(NO_HOLDING, 9.5e6, 0.5).supply < 0.0
    assert held(PILOT_CHECK, 8.0e6, 0.5) == held(NO_HOLDING, 8.0e6, 0.5)


def test_the_spool_opens_a_pilot_operated_check_valve_on_the_way_to_the_tank() -> None:
    assert held(PILOT_CHECK, 5e6, -0.5) == held(NO_HOLDING, 5e6, -0.5)


def test_a_counterbalance_valve_opens_with_the_load_and_three_times_its_pilot() -> None:
    """Load 4.9 MPa and pilot 0.4 MPa over the tank: 6.1 of 6 MPa, a tenth of the band."""
    free, part = (
        held(kind, 5e6, -0.5, pilot=TANK + 0.4e6) for kind in (NO_HOLDING, COUNTERBALANCE)
    )
    assert part.tank == pytest.approx(0.1 * free.tank)
    assert held(COUNTERBALANCE, 5e6, -0.5).tank == 0.0
    assert held(COUNTERBALANCE, 5e6, -0.5, pilot=2e6).tank == free.tank
    slightly = held(COUNTERBALANCE, 5e6 + 1.0, -0.5, pilot=TANK + 0.4e6)
    assert part.tank - slightly.tank == pytest.approx(part.tank_slope, rel=1e-3)
    assert COUNTERBALANCE_BAND_PA == 1e6


def test_a_load_sensing_pump_works_towards_the_load_and_a_margin_between_standby_and_maximum() -> (
    None
):
    unit = PowerUnit.of(
        kind=LOAD_SENSING, margin=1.5e6, standby=2e6, set_pressure=9e6, sensing_lag=0.05
    )
    supply = SupplyState.of(demand=2e6)
    demand_step(supply, unit, 3e6, 0.05)
    assert supply.demand == pytest.approx(2e6 + (4.5e6 - 2e6) * (1.0 - np.exp(-1.0)))
    for load, demand in ((0.0, 2e6), (1e5, 2e6), (4e6, 5.5e6), (8.5e6, 9e6)):
        demand_step(supply, unit, load, 10.0)
        assert supply.demand == pytest.approx(demand)


def test_an_unloading_supply_charges_to_its_pressure_and_rests_until_a_band_below() -> None:
    unit = PowerUnit.of(kind=UNLOADING, set_pressure=9e6, unloading_band=1e6, compensator_band=1e5)
    supply, strokes = SupplyState.of(pressure=7e6), []
    for pressure in (7e6, 8.9e6, 9e6, 8.5e6, 8.1e6, 8.0e6, 8.5e6):
        supply.pressure = pressure
        demand_step(supply, unit, 0.0, 1e-3)
        strokes.append(wanted_stroke(pressure, supply.demand, unit))
    assert strokes == [1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0]


def leg(changes: dict[str, float], opening: float, seconds: float = 3.0) -> tuple[Any, Any, float]:
    """One carrying vertical axis whose rod stands still: chambers, supply, and where A's pressure
    began.
    """
    machine = build_machine(changes)
    params, unit = axis_parameters(machine)[2:3].copy(), unit_parameters(machine)
    axes = start_axes(params, np.array([0.25]), np.array([1.2e4]))
    supply, given = start_supply(unit, 40.0, 0.06), AxisInput.zeros()
    given[0].extension, given[0].command = 0.25, opening
    start = float(axes[0].a.pressure)
    for _ in range(round(1e3 * seconds)):
        hydraulic_step(axes, params, given, supply, unit, 1e-3, 2)
    return axes, supply, start


def test_a_held_chamber_keeps_its_pressure_while_the_other_bleeds() -> None:
    tight = {"oil.internal_leakage_m3_s_pa": 0.0, "oil.hose_capacity_m3_pa": 0.0}
    tight |= {"oil.outer_leakage_m3_s_pa": 0.0, "valve.edge_pa_leakage_m3_s_pa": 0.0}
    tight |= {"valve.edge_pb_leakage_m3_s_pa": 0.0}
    axes, _, start = leg(tight | {"valve.holding_a": 1}, 0.0)
    assert axes[0].a.pressure == pytest.approx(start, rel=1e-9)
    assert axes[0].b.pressure < 1.0e6 + ATMOSPHERE_PA
    loose, _, start = leg(tight | {"valve.holding_a": 0}, 0.0)
    assert abs(loose[0].a.pressure - start) > 1e5


def test_a_load_sensing_supply_follows_the_leg_that_draws_and_rests_at_standby() -> None:
    sensing = {"power_unit.supply_kind": 1, "power_unit.accumulator_volume_m3": 0.0}
    _, supply, _ = leg(sensing, 0.0)
    assert supply.pressure - ATMOSPHERE_PA == pytest.approx(2.0e6, abs=4e5)
    axes, supply, _ = leg(sensing, 0.1, 0.5)
    assert supply.demand == pytest.approx(min(axes[0].a.pressure + 1.5e6, 9.1e6), rel=0.02)


def test_what_a_pump_senses_is_the_highest_pressure_that_is_opened_to_it() -> None:
    axes, supply, unit = AxisState.zeros(2), SupplyState.zeros()[0], PowerUnit.zeros()[0]
    for axis, (pressure_a, pressure_b) in zip(axes, ((5e6, 2e6), (9e6, 3e6)), strict=True):
        axis.a.pressure, axis.b.pressure = pressure_a, pressure_b
    unit.kind = LOAD_SENSING
    assert sensed_load(axes, np.array([[0.1], [0.0]]), supply, unit) == 5e6
    assert sensed_load(axes, np.array([[0.1], [-0.1]]), supply, unit) == 5e6
    assert sensed_load(axes, np.array([[-0.1], [-0.1]]), supply, unit) == 3e6
    assert sensed_load(axes, np.zeros((2, 1)), supply, unit) == 0.0
    supply.traction_load = 6e6
    assert sensed_load(axes, np.array([[0.1], [0.0]]), supply, unit) == 6e6 + ATMOSPHERE_PA
    unit.kind = 0
    assert sensed_load(axes, np.array([[0.1], [0.0]]), supply, unit) == 0.0
