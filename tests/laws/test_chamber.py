"""One chamber and its port against what a page of arithmetic gives."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from testbed.laws.axis_records import (
    AxisInput,
    AxisParameters,
    AxisState,
    AxisWork,
    ChamberParameters,
    ChamberWork,
)
from testbed.laws.chamber import begin, inverses, settle
from testbed.laws.hydraulics import hydraulic_step
from testbed.laws.oil import ATMOSPHERE_PA, gas_volume, specific_volume
from testbed.laws.orifice import port
from testbed.laws.supply import PowerUnit, SupplyState

BULK, AIR = 1.4e9, 0.005


def axis(pressure_a: float = 5e6, pressure_b: float = 2e6) -> tuple[Any, Any, Any]:
    """State, parameters and input of a cylinder at the middle of 0.5 m, its valve locked, nothing
    leaking.
    """
    params = AxisParameters.zeros()
    p = params[0]
    p.stroke, p.hose_time = 0.5, 1.0
    p.a.area, p.b.area = 4e-3, 2e-3
    p.a.dead_volume = p.b.dead_volume = 1e-4
    p.oil.bulk_modulus, p.oil.air = BULK, AIR
    p.valve.locked, p.valve.frequency, p.valve.damping, p.valve.amplifier_lag = (
        1.0,
        100.0,
        1.0,
        0.01,
    )
    p.transducers.pipe_frequency, p.transducers.pipe_damping, p.transducers.lag = 1e3, 0.7, 1e-3
    p.ends.cushion_length = 0.01
    for way in (p.seal.outward, p.seal.inward):
        way.stribeck_speed = 0.01
    p.seal.bristle_stiffness = 1e7
    axes = AxisState.zeros()
    for chamber, own, pressure, length in (
        (axes[0].a, p.a, pressure_a, 0.25),
        (axes[0].b, p.b, pressure_b, 0.25),
    ):
        chamber.pressure = chamber.hose_pressure = pressure
        chamber.oil = (own.dead_volume + own.area * length) / specific_volume(pressure, BULK, AIR)[
            0
        ]
    given = AxisInput.zeros()
    given[0].extension = 0.25
    return axes, params, given


def supply() -> tuple[Any, Any]:
    """A supply that nobody feeds."""
    unit = PowerUnit.of(
        compensator_band=1e5,
        compensator_lag=0.1,
        set_pressure=9e6,
        pump_power=1e4,
        relief_pressure=1e7,
        line_volume=1e-3,
        tank_pressure=ATMOSPHERE_PA,
        heat_capacity=1e6,
        droop_time=1.0,
        accumulator_precharge=1e7,
    )
    unit.oil.bulk_modulus, unit.oil.air = BULK, AIR
    nu, _ = specific_volume(9e6, BULK, AIR)
    return SupplyState.of(oil=1e-3 / nu, pressure=9e6, temperature=40.0), unit


def test_an_open_port_passes_the_orifice_s_flow_and_its_leakage() -> None:
    """k sqrt(4 MPa) = 2e-7 * 2000 m3/s from the supply, 1e-12 * 4.9 MPa to the tank."""
    chamber = ChamberParameters.of(from_supply=2e-7, to_tank=1e-7)
    work = ChamberWork.of(leak_to_tank=1e-12)
    flow = port(5e6, 9e6, 1e5, chamber, work, 1.0, 1.0)
    assert flow.supply == pytest.approx(2e-7 * 2000.0, rel=1e-4)
    assert flow.tank == pytest.approx(-1e-12 * 4.9e6)
    assert flow.supply_slope == pytest.approx(2e-7 * 0.5 / 2000.0, rel=1e-3)
    assert flow.supply_growth == flow.tank_growth == 0.0


def test_a_port_that_opens_to_the_tank_says_how_its_flow_grows() -> None:
    chamber, work = ChamberParameters.of(to_tank=1e-7), ChamberWork.of()
    flow = port(4.1e6, 9e6, 1e5, chamber, work, -0.2, -0.5)
    assert flow.supply == 0.0
    assert flow.tank == pytest.approx(-0.2 * 1e-7 * 2000.0, rel=1e-4)
    assert flow.tank_growth == pytest.approx(-0.3 * 1e-7 * 2000.0, rel=1e-4)


@pytest.mark.parametrize("hose", [0.0, 2.3e-13])
def test_inverses_are_one_over_pressure_and_one_over_the_oil_s_slope_less_the_hose(
    hose: float,
) -> None:
    p, oil = 5e6, 2e-4
    _, slope = specific_volume(p, BULK, AIR)
    per, inverse = inverses(p, oil, gas_volume(p, AIR), 1.0 / BULK, AIR, hose)
    assert per == pytest.approx(1.0 / p)
    assert inverse == pytest.approx(1.0 / (oil * slope - hose))


@pytest.mark.parametrize("far", [1.0, 1.5])
def test_oil_and_volume_of_a_chamber_balance_with_its_widened_hose(far: float) -> None:
    """Whether the pressure moved little or far: oil x nu(p) = volume + elasticity (p - p0)."""
    axes, params, given = axis()
    params["a"]["hose_elasticity"] = 2.3e-13
    work = AxisWork.zeros()
    begin(axes[0], params[0], given[0], 1e-3, work[0])
    chamber, w, oil = axes[0].a, work[0].a, params[0].oil
    chamber.oil *= 1.0 + 1e-3 * (far - 1.0) + 1e-7
    settle(chamber, w, chamber.pressure * far, oil, work[0])
    nu, _ = specific_volume(chamber.pressure, oil.bulk_modulus, oil.air)
    room = w.volume + 2.3e-13 * (chamber.pressure - ATMOSPHERE_PA)
    assert chamber.oil * nu == pytest.approx(room, rel=1e-9)


def test_a_chamber_that_settles_has_the_pressure_of_its_oil_and_volume() -> None:
    axes, params, given = axis()
    work = AxisWork.zeros()
    begin(axes[0], params[0], given[0], 1e-3, work[0])
    chamber, w = axes[0].a, work[0].a
    assert chamber.pressure == pytest.approx(5e6, rel=1e-6)
    w.volume *= 1.001
    settle(chamber, w, 4e6, params[0].oil, work[0])
    nu, slope = specific_volume(chamber.pressure, BULK, AIR)
    assert chamber.oil * nu == pytest.approx(w.volume, rel=1e-9)
    assert w.stiffness == pytest.approx(-nu / (chamber.oil * slope), rel=1e-6)


def test_a_shut_cylinder_keeps_its_oil_and_is_compressed_by_its_piston() -> None:
    """0.1 mm in 10 ms: 0.4 cm3 of A's 1.1 l, against the modulus of oil with air there."""
    axes, params, given = axis()
    state, unit = supply()
    before, oil = axes[0].a.pressure, axes[0].a.oil
    given[0].rate = -0.01
    for _ in range(10):
        hydraulic_step(axes, params, given, state, unit, 1e-3, 2)
        given[0].extension -= 1e-5
    nu, slope = specific_volume(before, BULK, AIR)
    assert axes[0].a.oil == oil
    rise = 4e-3 * 1e-4 / (oil * -slope)
    assert axes[0].a.pressure - before == pytest.approx(rise, rel=0.01)
    assert axes[0].b.pressure < 2e6 and math.isfinite(float(nu))


def test_inner_leakage_takes_from_a_what_it_gives_to_b() -> None:
    axes, params, given = axis()
    params[0].inner_leakage = 1e-12
    state, unit = supply()
    oil = np.array([axes[0].a.oil, axes[0].b.oil])
    for _ in range(100):
        hydraulic_step(axes, params, given, state, unit, 1e-3, 2)
    moved = np.array([axes[0].a.oil, axes[0].b.oil]) - oil
    assert moved.sum() == pytest.approx(0.0, abs=1e-14 * float(oil.sum()))
    drop = 0.5 * (3e6 + axes[0].a.pressure - axes[0].b.pressure)
    assert moved[1] == pytest.approx(0.1 * 1e-12 * drop, rel=0.01)
