"""Balances of oil and energy of the hydraulics, kept outside the kernel while twelve loaded axes
work; and the creep of resting pistons.

The energy that a place stores is that of its pressure (oil.py), the wall of a hose and the gas of
the accumulator included; oil at rest in the tank counts with the enthalpy of the tank's pressure.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.hydraulics.free_mass import FreeRig, Mass
from testbed.benchmarks.hydraulics.reference import SET
from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.formats.records import Record, Records, quantity
from testbed.laws.axis_records import AxisInput, AxisParameters, AxisState
from testbed.laws.friction import stribeck_level
from testbed.laws.hydraulics import hydraulic_step
from testbed.laws.initial import start_axes, start_supply
from testbed.laws.oil import ATMOSPHERE_PA, VAPOUR_PA, enthalpy, specific_volume
from testbed.laws.supply import PowerUnit, SupplyState
from testbed.machine.build import build_machine
from testbed.machine.provenance import SetName
from testbed.scenario.parts import Rates
from testbed.world.hydraulic_parameters import axis_parameters, unit_parameters

STEP_S = 1e-3


class Driven(Record):
    """A mass on a rod, and the command that drives it to and fro."""

    middle = quantity("m", "extension about which it is driven")
    mass = quantity("kg", "on the rod")
    external = quantity("N", "pushes it, + out")
    amplitude = quantity("1", "of the sinusoidal command")
    turn = quantity("rad/s", "its frequency")


class Books(Record):
    """What has been counted from outside."""

    step = quantity("1", "steps done", kind="i8")
    mechanical = quantity("J", "work of the rods")
    highest_power = quantity("W", "of the pump")
    lowest_pressure = quantity("Pa", "of any chamber, absolute")
    travel = quantity("m", "of all pistons")


@dataclass(frozen=True)
class Balance:
    """What came of `seconds` of work; energies in J."""

    seconds: float
    oil_lost: float
    """Oil gained or lost, as a share of what the pump moved."""
    pump_j: float
    mechanical_j: float
    traction_j: float
    stored_j: float
    loss_j: float
    energy_lost: float
    """Pump work less mechanical and traction work, stored energy and losses, as a share of pump
    work.
    """
    highest_power_w: float
    lowest_pressure_pa: float
    travel_m: float


@njit
def work_loop(
    axes: Records[AxisState],
    params: Records[AxisParameters],
    given: Records[AxisInput],
    driven: Records[Driven],
    unit: tuple[Any, Any],
    steps: int,
    substeps: int,
    books: Books,
) -> None:
    """Masses on the rods (Driven), pushed and driven round their middle; unit: a SupplyState and
    its PowerUnit.

    Positions move by the rates that the kernel was given, so that its work and the rods' are the
    same.
    """
    n = axes.shape[0]
    supply, power = unit
    for _ in range(steps):
        t = books.step * STEP_S
        for index in range(n):
            d, rod = driven[index], given[index]
            wave = math.sin(d.turn * t)
            band = math.copysign(params[index].valve.dead_band, wave)
            rod.command = d.amplitude * wave + band - 0.6 * (rod.extension - d.middle)
        hydraulic_step(axes, params, given, supply, power, STEP_S, substeps)
        for index in range(n):
            axis, rod = axes[index], given[index]
            # the atmosphere pushes on the rod's cross-section: work of the pressures, not of the
            # rod
            air = (params[index].a.area - params[index].b.area) * ATMOSPHERE_PA
            books.mechanical += STEP_S * rod.rate * (axis.force + air)
            books.travel += STEP_S * abs(rod.rate)
            rod.extension += STEP_S * rod.rate
            rod.rate += STEP_S * (axis.force + driven[index].external) / driven[index].mass
            lowest = min(axis.a.pressure, axis.b.pressure)
            books.lowest_pressure = min(books.lowest_pressure, lowest)
        books.highest_power = max(books.highest_power, supply.pump_power)
        books.step += 1


def oil(axes: NDArray[Any], params: NDArray[Any], supply: SupplyState) -> float:
    """Standard volume of all oil, m3."""
    total = supply.oil + supply.tank_oil
    for name in ("a", "b"):
        chambers = axes[name]
        hoses = params[name]["hose_capacity"] * chambers["hose_pressure"]
        total += chambers["oil"].sum() + hoses.sum()
    return float(total)


def stored(axes: NDArray[Any], params: NDArray[Any], supply: SupplyState, unit: PowerUnit) -> float:
    """Energy in chambers, hoses, line, accumulator and tank, J (its zero does not matter)."""
    total = 0.0
    for axis, param in zip(axes, params, strict=True):
        bulk, air = param.oil.bulk_modulus, param.oil.air
        for name in ("a", "b"):
            chamber = axis[name]
            total += chamber.oil * _energy(chamber.pressure, bulk, air)
            widened = param[name].hose_elasticity * (chamber.pressure**2 - ATMOSPHERE_PA**2)
            total += 0.5 * widened
            grid = np.linspace(ATMOSPHERE_PA, chamber.hose_pressure, 400)
            h = np.array([enthalpy(q, bulk, air) for q in grid])
            total += param[name].hose_capacity * float(np.trapezoid(h, grid))
    bulk, air, ps = unit.oil.bulk_modulus, unit.oil.air, supply.pressure
    total += supply.oil * _energy(ps, bulk, air)
    total += supply.tank_oil * enthalpy(unit.tank_pressure, bulk, air)
    if ps > unit.accumulator_precharge:
        gas = unit.accumulator_volume * unit.accumulator_precharge
        total += gas * math.log(ps / unit.accumulator_precharge)
    return float(total)


def _energy(p: float, bulk: float, air: float) -> float:
    """H - p nu, J per standard m3."""
    return float(enthalpy(p, bulk, air) - p * specific_volume(p, bulk, air)[0])


def machine(of_set: SetName = SET) -> tuple[NDArray[Any], Any]:
    """Parameters of the twelve axes and of the power unit of a set of the machine's numbers."""
    p = build_machine(of_set=of_set)
    return axis_parameters(p), unit_parameters(p)


def balance(
    seconds: float = 600.0,
    substeps: int | None = None,
    drive: float = 0.25,
    progress: Callable[[float], None] | None = None,
    of_set: SetName = SET,
) -> Balance:
    """Twelve loaded axes and both traction devices at work for `seconds`; `drive`: size of the
    commands.
    """
    params, unit = machine(of_set)
    n = len(params)
    rng = np.random.default_rng(20090716)
    given, driven, books = AxisInput.zeros(n), Driven.zeros(n), Books.zeros()[0]
    given["extension"] = driven["middle"] = np.tile([0.12, 0.2, 0.25], 4)
    driven["external"], driven["mass"] = np.tile([0.0, 1500.0, -9000.0], 4), 600.0
    axes = start_axes(params, driven["middle"], -driven["external"])
    supply = start_supply(unit, 40.0, 0.06)
    supply.traction_flow = 3e-5
    driven["amplitude"] = rng.uniform(0.3, 1.0, n) * drive
    driven["turn"] = rng.uniform(1.5, 5.0, n)
    books.lowest_pressure = np.inf
    oil_0, stored_0 = oil(axes, params, supply), stored(axes, params, supply, unit)
    steps, chunk = round(seconds / STEP_S), 10_000
    each = substeps or Rates().hydraulic_substeps
    for first in range(0, steps, chunk):
        count = min(chunk, steps - first)
        work_loop(axes, params, given, driven, (supply, unit), count, each, books)
        if progress is not None:
            progress(min(first + chunk, steps) * STEP_S)
    pump = float(supply.pump_work)
    gained = stored(axes, params, supply, unit) - stored_0
    spent = books.mechanical + supply.traction_work + gained + supply.loss
    return Balance(
        seconds,
        float((oil(axes, params, supply) - oil_0) / supply.throughput),
        pump,
        float(books.mechanical),
        float(supply.traction_work),
        gained,
        float(supply.loss),
        float((pump - spent) / pump),
        float(books.highest_power),
        float(books.lowest_pressure),
        float(books.travel),
    )


# A piston stuck below break-away behind shut valves: how far it goes, and how much of that its
# leakage explains.
#
# Explained is the way of an ideal piston: the oil that the leaks carried (their laws integrated
# over the pressures, beside the kernel's own books) and the hoses took fixes the chambers'
# pressures as functions of the extension; the piston stands where they balance the load and a dry
# friction that gives like a spring up to its level and no further.

CARRIED_N, MASS_KG, SETTLE_S, LOOK_S = 7000.0, 100.0, 1.0, 0.01
MIDDLE_M = 0.25


@dataclass(frozen=True)
class Creep:
    """A piston stuck below break-away behind shut valves, watched for `seconds`; + out."""

    seconds: float
    load_n: float
    """Added to what it carried in equilibrium, against its friction."""
    moved_m: float
    leakage_explains_m: float
    beyond_m: float
    """How far it went otherwise than leakage explains (the largest of all times)."""


def creep(seconds: float = 60.0, share: float = 0.5, leakage: bool = True) -> Creep:
    """A vertical axis at rest, then loaded by `share` of its break-away more, valves shut for
    `seconds`.
    """
    params, unit = machine()
    params = params[2:3].copy()
    p = params[0]
    p.valve.locked = 1.0
    if not leakage:
        p.inner_leakage = p.outer_leakage = 0.0
    masses = Mass.zeros()
    masses["mass"], masses["position"] = MASS_KG, MIDDLE_M
    axes = start_axes(params, masses["position"], np.array([CARRIED_N]))
    rig = FreeRig(axes, params, start_supply(unit, 40.0, 0.06), unit, masses)
    axis, rod = axes[0], masses[0]
    extra = share * float(p.seal.inward.coulomb + p.seal.inward.static)
    load = CARRIED_N + extra

    def run(span_s: float) -> None:
        steps = round(span_s / STEP_S)
        rig.run(np.zeros(steps), np.full(steps, load))

    run(SETTLE_S)
    start, held = float(rod.position), float(axis.friction)
    hoses = np.array([p.a.hose_capacity, p.b.hose_capacity])
    oil, hose = _both(axis, "oil"), _both(axis, "hose_pressure")
    leaked, flow, explained, beyond = np.zeros(2), _leaks(axis, p, unit), start, 0.0
    for index in range(round(seconds / LOOK_S)):
        run(LOOK_S)
        before, flow = flow, _leaks(axis, p, unit)
        leaked += 0.5 * LOOK_S * (before + flow)
        if index % 10 != 9:
            continue
        now = oil + leaked - hoses * (_both(axis, "hose_pressure") - hose)
        level = _level(axis, p, float(rod.position), float(rod.rate))
        explained = _stands_at(now, p, load, held, start, -level)
        beyond = max(beyond, abs(float(rod.position) - explained))
    return Creep(seconds, extra, float(rod.position) - start, explained - start, beyond)


def _both(axis: Any, name: str) -> Array:
    """A quantity of both chambers, (2)."""
    return np.array([axis.a[name], axis.b[name]])


def _leaks(s: AxisState, p: AxisParameters, unit: PowerUnit) -> Array:
    """Leakage into chambers A and B, m3/s: across the piston and outwards, valve and edges shut."""
    across = s.leaking * p.inner_leakage * (s.a.pressure - s.b.pressure)
    out = s.leaking * p.outer_leakage * (_both(s, "pressure") - unit.tank_pressure)
    return np.asarray(np.array([-across, across]) - out)


def _level(s: AxisState, p: AxisParameters, x: float, v: float) -> float:
    """The friction at which the piston slides inwards, N: (4) with its parts along the stroke, by
    pressure, by rest.
    """
    fc = p.seal.inward.coulomb * (1.0 + p.seal.position_slope * (x / p.stroke - 0.5))
    fc += p.seal.pressure_coefficient * (s.a.pressure + s.b.pressure - 2.0 * ATMOSPHERE_PA)
    return float(
        stribeck_level(
            abs(v), fc, p.seal.inward.static + fc * s.seal.dwell, p.seal.inward.stribeck_speed
        )
        + p.seal.inward.viscous * abs(v)
    )


def _stands_at(
    oil: Array, p: AxisParameters, load: float, held: float, start: float, level: float
) -> float:
    """Extension, m, at which the oil of both chambers balances load and friction, by bisection.

    Friction: `held` (N) at `start`, from there a spring with the bristle's stiffness, never beyond
    `level` (inwards).
    """

    def push(x: float) -> float:
        pa = _pressure(p.a.dead_volume + p.a.area * x, oil[0], p.a.hose_elasticity, p)
        left = p.stroke - x
        pb = _pressure(p.b.dead_volume + p.b.area * left, oil[1], p.b.hose_elasticity, p)
        friction = max(held + p.seal.bristle_stiffness * (x - start), level)
        gauge = pa * p.a.area - pb * p.b.area - (p.a.area - p.b.area) * ATMOSPHERE_PA
        return float(gauge - friction - load)

    low, high = start - 0.1, start + 0.1
    for _ in range(38):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if push(middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)


def _pressure(volume: float, oil: float, elasticity: float, p: AxisParameters) -> float:
    """Absolute pressure, Pa, of `oil` in a volume whose hose widens, m3: Newton's iteration."""
    pressure = 5e6
    for _ in range(30):
        found, slope = specific_volume(pressure, p.oil.bulk_modulus, p.oil.air)
        room = volume + elasticity * (pressure - ATMOSPHERE_PA)
        step = (room - oil * found) / (oil * slope - elasticity)
        pressure = max(pressure + step, 0.5 * pressure, VAPOUR_PA)
        if abs(step) < 1e-3:
            break
    return float(pressure)
