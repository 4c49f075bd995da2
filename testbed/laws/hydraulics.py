"""Twelve differential cylinders with their valves on one supply: the compiled step that runs beside the engine.

    F = pA A_A - pB A_B - (A_A - A_B) p_atm - friction + cushions and stops        (pushes the rod out)

The engine holds joint rates over its step, so whatever depends on command and rate alone (amplifier, hysteresis, spool,
bristle, dwell, cushions, stops, transducers) is advanced in closed form; the oil of all chambers and of the supply is
advanced together in substeps (chamber.py, supply.py).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from testbed.laws import columns as c
from testbed.laws.chamber import WORK, begin, close_step, first_stage, kept_by_hoses, second_stage
from testbed.laws.compiling import njit_law
from testbed.laws.ends import end_force, extra_force
from testbed.laws.friction import friction_step
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.laws.supply import (
    ENTHALPY,
    ENTHALPY_TANK,
    KD_1,
    UNIT_WORK,
    begin_supply,
    end_supply,
    supply_first,
    supply_second,
)
from testbed.laws.transducer import sense_path, transducer_weights
from testbed.laws.valve import spool_weights, valve_path


@njit_law
def open_valves(axes: Any, params: Any, command: Any, h: float, openings: Any) -> None:
    """Openings of all axes at the ends of the substeps, (n, substeps + 1)."""
    p = params[0]
    weights = spool_weights(p[c.SPOOL_WN], p[c.SPOOL_ZETA], p[c.AMP_TAU], h)
    last = p
    for i in range(axes.shape[0]):
        p = params[i]
        if (
            p[c.SPOOL_WN] != last[c.SPOOL_WN]
            or p[c.SPOOL_ZETA] != last[c.SPOOL_ZETA]
            or p[c.AMP_TAU] != last[c.AMP_TAU]
        ):
            weights = spool_weights(p[c.SPOOL_WN], p[c.SPOOL_ZETA], p[c.AMP_TAU], h)
            last = p
        valve_path(axes[i], p, command[i], h, weights, openings[i])
        if p[c.LOCKED] != 0.0:
            for k in range(openings.shape[1]):
                openings[i, k] = 0.0


@njit_law
def sense(axes: Any, params: Any, a: Any, b: Any, h: float) -> None:
    """Transducers of all axes along the chambers' pressures a, b (n, substeps + 1)."""
    p = params[0]
    weights = transducer_weights(p[c.LINE_WN], p[c.LINE_ZETA], p[c.TRANSDUCER_TAU], h)
    last = p
    for i in range(axes.shape[0]):
        p = params[i]
        if (
            p[c.LINE_WN] != last[c.LINE_WN]
            or p[c.LINE_ZETA] != last[c.LINE_ZETA]
            or p[c.TRANSDUCER_TAU] != last[c.TRANSDUCER_TAU]
        ):
            weights = transducer_weights(p[c.LINE_WN], p[c.LINE_ZETA], p[c.TRANSDUCER_TAU], h)
            last = p
        sense_path(axes[i], p, a[i], b[i], h, weights)


@njit_law(forceinline=True)
def mean_of_nodes(values: Any) -> float:
    """Trapezoidal mean of values at the ends of equal intervals."""
    total = 0.5 * (values[0] + values[-1])
    for k in range(1, values.shape[0] - 1):
        total += values[k]
    return float(total / (values.shape[0] - 1))


@njit_law
def rod_forces(
    axes: Any,
    params: Any,
    work: Any,
    x: Any,
    v: Any,
    load: Any,
    side: Any,
    a: Any,
    b: Any,
    viscosity: float,
    warmth: float,
    t: float,
    dt: float,
) -> float:
    """Mean force and friction of all axes over dt into FORCE and FRICTION; returns the heat beside the valves', J."""
    heat = 0.0
    extra_rate = 0.0
    warm = math.exp(-viscosity * warmth)
    for i in range(axes.shape[0]):
        s, p = axes[i], params[i]
        if p[c.EXTRA_VISC_RATE] != extra_rate:
            extra_rate = p[c.EXTRA_VISC_RATE]
            warm = math.exp(-(viscosity + extra_rate) * warmth)
        s[c.WARM] = warm
        mean_a, mean_b = mean_of_nodes(a[i]), mean_of_nodes(b[i])
        friction = friction_step(
            s, p, x[i] + 0.5 * dt * v[i], v[i], mean_a, mean_b, warm, load[i], side[i], dt
        )
        ends = end_force(p, x[i], v[i], dt)
        force = (
            mean_a * p[c.AREA_A]
            - mean_b * p[c.AREA_B]
            - (p[c.AREA_A] - p[c.AREA_B]) * ATMOSPHERE_PA
        )
        s[c.FORCE] = force + ends + extra_force(p, x[i], v[i], t, dt) - friction
        s[c.FRICTION], s[c.END_FORCE] = friction, ends
        heat += dt * v[i] * (friction - ends) - kept_by_hoses(axes, params, work, i)
    return heat


@njit_law
def hydraulic_step(
    axes: Any,
    params: Any,
    supply: Any,
    unit: Any,
    x: Any,
    v: Any,
    command: Any,
    load: Any,
    side: Any,
    dt: float,
    substeps: int,
) -> None:
    """Advance all axes and the power unit by dt in `substeps`, in place.

    axes (n, AXIS_STATES), params (n, AXIS_PARAMETERS), supply (SUPPLY_STATES), unit (SUPPLY_PARAMETERS): columns.py.
    x, v (n): extension (m) and rate (m/s), the rate taken constant over dt. command (n): -1..1.
    load, side (n): axial and side load on the rod, N, for load-dependent friction.
    Leaves in axes[:, FORCE] the cylinder's mean force on its rod over dt (N, + pushes out), in axes[:, FRICTION]
    the mean friction (N, against + v), in axes[:, END_FORCE] that of cushions and stops (N, along + x).
    """
    n = axes.shape[0]
    h = dt / substeps
    work = np.empty((n, WORK))
    unit_work = np.empty(UNIT_WORK)
    openings, a, b = (
        np.empty((n, substeps + 1)),
        np.empty((n, substeps + 1)),
        np.empty((n, substeps + 1)),
    )
    warmth, loss = supply[c.TEMPERATURE] - unit[c.VISC_REFERENCE], supply[c.LOSS]
    pt = unit[c.TANK_P]
    open_valves(axes, params, command, h, openings)
    begin(axes, params, x, v, h, work, a, b)
    begin_supply(supply, unit, unit_work)
    returned = heat = 0.0
    for k in range(substeps):
        drawn, rise = first_stage(
            axes, params, work, openings, k, supply[c.P_SUPPLY] + supply[c.DROOP_P], pt, h
        )
        enthalpy = unit_work[ENTHALPY]
        q, ahead = supply_first(supply, unit, unit_work, drawn, rise, h)
        seen = ahead + supply[c.DROOP_P] + h * unit_work[KD_1]
        drawn = second_stage(axes, params, work, openings, k, q, seen, pt, h)
        q = supply_second(supply, unit, unit_work, ahead, drawn, rise, h)
        enthalpy = 0.5 * (enthalpy + unit_work[ENTHALPY])
        _, back, warm = close_step(
            axes, params, work, k, q, enthalpy, unit_work[ENTHALPY_TANK], h, a, b
        )
        returned += back
        heat += warm
    heat += rod_forces(
        axes, params, work, x, v, load, side, a, b, unit[c.VISC_RATE], warmth, supply[c.TIME], dt
    )
    sense(axes, params, a, b, h)
    end_supply(supply, unit, unit_work, returned, heat, loss, dt)
