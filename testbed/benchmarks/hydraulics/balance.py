"""The books of the hydraulics kept from outside: oil and energy while twelve loaded axes work, creep at rest.

The energy that a place stores is that of its pressure (oil.py), the wall of a hose and the gas of the accumulator
included; oil at rest in the tank counts with the enthalpy of the tank's pressure.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.laws import columns as c
from testbed.laws.hydraulics import hydraulic_step
from testbed.laws.initial import start_axes, start_supply
from testbed.laws.oil import ATMOSPHERE_PA, enthalpy, specific_volume
from testbed.machine.build import build_machine
from testbed.scenario.parts import Rates
from testbed.world.plumbing import axis_parameters, unit_parameters

Array = NDArray[np.float64]
STEP_S = 1e-3
(MECHANICAL, HIGHEST_POWER, LOWEST_PRESSURE, TRAVEL, SLOWEST) = range(5)


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
    """Pump work less mechanical and traction work, stored energy and losses, as a share of pump work."""
    highest_power_w: float
    lowest_pressure_pa: float
    travel_m: float


@njit
def work_loop(
    axes: Any,
    params: Any,
    supply: Any,
    unit: Any,
    x: Any,
    v: Any,
    start: Any,
    mass: Any,
    external: Any,
    amplitude: Any,
    rate: Any,
    first: int,
    steps: int,
    substeps: int,
    totals: Any,
) -> None:
    """Masses on the rods, pushed by `external` (N) and driven round `start` (m) by sinusoidal commands.

    Positions move by the rates that the kernel was given, so that its work and the rods' are the same.
    """
    n = x.shape[0]
    command, zero = np.empty(n), np.zeros(n)
    for k in range(first, first + steps):
        t = k * STEP_S
        for i in range(n):
            wave = math.sin(rate[i] * t)
            command[i] = (
                amplitude[i] * wave
                + math.copysign(params[i, c.DEADBAND], wave)
                - 0.6 * (x[i] - start[i])
            )
        hydraulic_step(axes, params, supply, unit, x, v, command, zero, zero, STEP_S, substeps)
        for i in range(n):
            # the atmosphere pushes on the rod's cross-section: work of the pressures, not of the rod
            air = (params[i, c.AREA_A] - params[i, c.AREA_B]) * ATMOSPHERE_PA
            totals[MECHANICAL] += STEP_S * v[i] * (axes[i, c.FORCE] + air)
            totals[TRAVEL] += STEP_S * abs(v[i])
            x[i] += STEP_S * v[i]
            v[i] += STEP_S * (axes[i, c.FORCE] + external[i]) / mass[i]
            lowest = min(axes[i, c.P_A], axes[i, c.P_B])
            totals[LOWEST_PRESSURE] = min(totals[LOWEST_PRESSURE], lowest)
        totals[HIGHEST_POWER] = max(totals[HIGHEST_POWER], supply[c.PUMP_POWER_NOW])


def oil(axes: Array, params: Array, supply: Array) -> float:
    """Standard volume of all oil, m3."""
    hoses = (
        params[:, c.HOSE_CAP] * axes[:, c.HOSE_P] + params[:, c.HOSE_CAP_B] * axes[:, c.HOSE_P_B]
    )
    return float(
        axes[:, c.OIL_A].sum()
        + axes[:, c.OIL_B].sum()
        + hoses.sum()
        + supply[c.OIL_SUPPLY]
        + supply[c.OIL_TANK]
    )


def stored(axes: Array, params: Array, supply: Array, unit: Array) -> float:
    """Energy in chambers, hoses, line, accumulator and tank, J (its zero does not matter)."""
    total = 0.0
    for s, p in zip(axes, params, strict=True):
        for quantity, pressure in ((c.OIL_A, c.P_A), (c.OIL_B, c.P_B)):
            total += s[quantity] * _energy(s[pressure], p[c.BULK], p[c.AIR])
        for capacity, pressure in ((c.HOSE_CAP, c.HOSE_P), (c.HOSE_CAP_B, c.HOSE_P_B)):
            grid = np.linspace(ATMOSPHERE_PA, s[pressure], 400)
            h = np.array([enthalpy(q, p[c.BULK], p[c.AIR]) for q in grid])
            total += p[capacity] * float(np.trapezoid(h, grid))
    bulk, air, ps = unit[c.SUPPLY_BULK], unit[c.SUPPLY_AIR], supply[c.P_SUPPLY]
    total += supply[c.OIL_SUPPLY] * _energy(ps, bulk, air) + supply[c.OIL_TANK] * enthalpy(
        unit[c.TANK_P], bulk, air
    )
    if ps > unit[c.ACC_PRECHARGE]:
        total += unit[c.ACC_VOLUME] * unit[c.ACC_PRECHARGE] * math.log(ps / unit[c.ACC_PRECHARGE])
    return float(total)


def _energy(p: float, bulk: float, air: float) -> float:
    """h - p nu, J per standard m3."""
    return float(enthalpy(p, bulk, air) - p * specific_volume(p, bulk, air)[0])


def machine() -> tuple[Array, Array]:
    """Parameters of the twelve axes and of the power unit, as declared."""
    p = build_machine()
    return axis_parameters(p), unit_parameters(p)


def balance(
    seconds: float = 600.0,
    substeps: int | None = None,
    drive: float = 0.25,
    progress: Callable[[float], None] | None = None,
) -> Balance:
    """Twelve loaded axes and both traction devices at work for `seconds`; `drive`: size of the commands."""
    params, unit = machine()
    n = len(params)
    rng = np.random.default_rng(20090716)
    start = np.tile([0.12, 0.2, 0.25], 4)
    external = np.tile([0.0, 1500.0, -9000.0], 4)
    axes = start_axes(params, start, -external)
    supply = start_supply(unit, 40.0, 0.06)
    supply[c.TRACTION_FLOW] = 3e-5
    x, v, mass = start.copy(), np.zeros(n), np.full(n, 600.0)
    amplitude, rate = rng.uniform(0.3, 1.0, n) * drive, rng.uniform(1.5, 5.0, n)
    oil_0, stored_0 = oil(axes, params, supply), stored(axes, params, supply, unit)
    totals = np.array([0.0, 0.0, np.inf, 0.0, 0.0])
    steps, chunk = round(seconds / STEP_S), 10_000
    for first in range(0, steps, chunk):
        work_loop(
            axes,
            params,
            supply,
            unit,
            x,
            v,
            start,
            mass,
            external,
            amplitude,
            rate,
            first,
            min(chunk, steps - first),
            substeps or Rates().hydraulic_substeps,
            totals,
        )
        if progress is not None:
            progress(min(first + chunk, steps) * STEP_S)
    pump = float(supply[c.PUMP_WORK])
    gained = stored(axes, params, supply, unit) - stored_0
    spent = totals[MECHANICAL] + supply[c.TRACTION_WORK] + gained + supply[c.LOSS]
    return Balance(
        seconds,
        float((oil(axes, params, supply) - oil_0) / supply[c.THROUGHPUT]),
        pump,
        float(totals[MECHANICAL]),
        float(supply[c.TRACTION_WORK]),
        gained,
        float(supply[c.LOSS]),
        float((pump - spent) / pump),
        float(totals[HIGHEST_POWER]),
        float(totals[LOWEST_PRESSURE]),
        float(totals[TRAVEL]),
    )
