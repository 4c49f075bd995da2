"""The books of the hydraulics kept from outside: oil and energy while twelve loaded axes work,
creep at rest.

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

from testbed.benchmarks.hydraulics.reference import SET
from testbed.compiled import njit
from testbed.formats.records import Record, quantity
from testbed.laws.hydraulics import AxisInput, hydraulic_step
from testbed.laws.initial import start_axes, start_supply
from testbed.laws.oil import ATMOSPHERE_PA, enthalpy, specific_volume
from testbed.machine.build import build_machine
from testbed.machine.provenance import SetName
from testbed.scenario.world_parts import Rates
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
    axes: Any,
    params: Any,
    given: Any,
    driven: Any,
    unit: tuple[Any, Any],
    steps: int,
    substeps: int,
    books: Any,
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


def oil(axes: NDArray[Any], params: NDArray[Any], supply: Any) -> float:
    """Standard volume of all oil, m3."""
    total = supply.oil + supply.tank_oil
    for name in ("a", "b"):
        chambers = axes[name]
        hoses = params[name]["hose_capacity"] * chambers["hose_pressure"]
        total += chambers["oil"].sum() + hoses.sum()
    return float(total)


def stored(axes: NDArray[Any], params: NDArray[Any], supply: Any, unit: Any) -> float:
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
