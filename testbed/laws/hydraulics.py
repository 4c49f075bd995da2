"""Twelve differential cylinders with their valves on one supply: the compiled step that runs beside
the engine.

    F = pA A_A - pB A_B - (A_A - A_B) p_atm - friction + cushions and stops

F is positive when it pushes the rod out.

Joint rates are constant during a step of the engine. Everything that depends on command and rate
alone (amplifier, hysteresis, spool, bristle, dwell, cushions, stops, transducers) is therefore
advanced in closed form; the oil of all chambers and of the supply is integrated together, in
substeps (chamber.py, supply.py).
"""

from __future__ import annotations

import math

import numpy as np

from testbed.compiled import njit_law
from testbed.formats.arrays import Array
from testbed.formats.records import Records
from testbed.laws.axis_records import AxisInput, AxisParameters, AxisState, AxisWork
from testbed.laws.chamber import begin, close_step, first_stage, kept_by_hoses, second_stage
from testbed.laws.end_stops import end_force, extra_force
from testbed.laws.friction import friction_step
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.laws.supply import (
    LOAD_SENSING,
    PowerUnit,
    SupplyState,
    SupplyWork,
    begin_supply,
    demand_step,
    end_supply,
    supply_first,
    supply_second,
)
from testbed.laws.transducer import sense_path, transducer_weights
from testbed.laws.valve import spool_weights, valve_path

AXIS_WORK, SUPPLY_WORK = AxisWork.dtype, SupplyWork.dtype


@njit_law
def open_valves(
    axes: Records[AxisState],
    params: Records[AxisParameters],
    given: Records[AxisInput],
    h: float,
    openings: Array,
) -> None:
    """Openings of all axes at the ends of the substeps, (n, substeps + 1)."""
    p = params[0].valve
    weights = spool_weights(p.frequency, p.damping, p.amplifier_lag, h)
    last = p
    for index in range(axes.shape[0]):
        p = params[index].valve
        if (
            p.frequency != last.frequency
            or p.damping != last.damping
            or p.amplifier_lag != last.amplifier_lag
        ):
            weights = spool_weights(p.frequency, p.damping, p.amplifier_lag, h)
            last = p
        valve_path(axes[index].valve, p, given[index].command, h, weights, openings[index])
        if p.locked != 0.0:
            for k in range(openings.shape[1]):
                openings[index, k] = 0.0


@njit_law
def sensed_load(
    axes: Records[AxisState], openings: Array, supply: SupplyState, unit: PowerUnit
) -> float:
    """Highest pressure among the chambers and traction devices connected to the supply, Pa
    absolute; 0 if there is none, or if the pump is not load-sensing.
    """
    load = 0.0
    if unit.kind != LOAD_SENSING:
        return load
    for index in range(axes.shape[0]):
        o = openings[index, -1]
        if o > 0.0:
            load = max(load, axes[index].a.pressure)
        elif o < 0.0:
            load = max(load, axes[index].b.pressure)
    if supply.traction_load > 0.0:
        load = max(load, supply.traction_load + ATMOSPHERE_PA)
    return load


@njit_law
def sense(
    axes: Records[AxisState], params: Records[AxisParameters], a: Array, b: Array, h: float
) -> None:
    """Transducers of all axes along the chambers' pressures a, b (n, substeps + 1)."""
    p = params[0].transducers
    weights = transducer_weights(p.pipe_frequency, p.pipe_damping, p.lag, h)
    last = p
    for index in range(axes.shape[0]):
        p = params[index].transducers
        if (
            p.pipe_frequency != last.pipe_frequency
            or p.pipe_damping != last.pipe_damping
            or p.lag != last.lag
        ):
            weights = transducer_weights(p.pipe_frequency, p.pipe_damping, p.lag, h)
            last = p
        sense_path(axes[index].transducers, p, a[index], b[index], h, weights)


@njit_law(forceinline=True)
def mean_of_nodes(values: Array) -> float:
    """Trapezoidal mean of values at the ends of equal intervals."""
    total = 0.5 * (values[0] + values[-1])
    for index in range(1, values.shape[0] - 1):
        total += values[index]
    return float(total / (values.shape[0] - 1))


@njit_law(forceinline=True)
def rod_force(
    axis: AxisState,
    p: AxisParameters,
    rod: AxisInput,
    mean_a: float,
    mean_b: float,
    t: float,
    dt: float,
) -> float:
    """Write the mean force, friction and end force of one axis over dt into the axis; returns the
    jump of its extension since the end of its last step, m.

    mean_a, mean_b: mean pressures of its chambers, Pa absolute; t: start of the step, s. Uses
    axis.thinning of this step.
    """
    x, v = rod.extension, rod.rate
    skipped = x - axis.reached
    # What cushions and stops see of rate and place: coupling.py.
    speed = v + skipped / dt if skipped * axis.skipped > 0.0 else v
    place = (x + 0.5 * dt * v) / p.stroke - 0.5
    pressures = mean_a + mean_b - 2.0 * ATMOSPHERE_PA
    friction = friction_step(axis.seal, p.seal, rod, skipped, place, pressures, axis.thinning, dt)
    at = x + (2.0 * skipped - axis.skipped) / 6.0
    ends = end_force(p.ends, p.stroke, at, v, speed, dt)
    force = mean_a * p.a.area - mean_b * p.b.area - (p.a.area - p.b.area) * ATMOSPHERE_PA
    axis.force = force + ends + extra_force(p.extra, x, v, t, dt) - friction
    axis.friction, axis.end_force = friction, ends
    axis.reached, axis.skipped = x + dt * v, skipped
    return skipped


@njit_law
def rod_forces(
    axes: Records[AxisState],
    params: Records[AxisParameters],
    given: Records[AxisInput],
    work: Records[AxisWork],
    a: Array,
    b: Array,
    t: float,
    dt: float,
) -> float:
    """Mean force of every axis over dt from the pressures a, b (n, substeps + 1) of its chambers;
    returns the work of the rods that friction, ends and hoses turned into heat, J.
    """
    rubbed = 0.0
    for index in range(axes.shape[0]):
        axis, p, rod = axes[index], params[index], given[index]
        before = axis.friction - axis.end_force
        mean_a, mean_b = mean_of_nodes(a[index]), mean_of_nodes(b[index])
        skipped = rod_force(axis, p, rod, mean_a, mean_b, t, dt)
        braking = axis.friction - axis.end_force
        spent = dt * rod.rate * braking + 0.5 * skipped * (before + braking)
        rubbed += spent - kept_by_hoses(axis, p, work[index])
    return rubbed


@njit_law
def thin_oil(
    axes: Records[AxisState],
    params: Records[AxisParameters],
    viscosity: float,
    warmth: float,
    beyond: float,
) -> None:
    """Set two factors of every axis: `thinning` of viscous friction, `warmth` K above its reference
    temperature, and `leaking` of leakage, `beyond` K above its own.
    """
    extra_rate = 0.0
    thinning, leaking = math.exp(-viscosity * warmth), math.exp(viscosity * beyond)
    for index in range(axes.shape[0]):
        axes[index].leaking = leaking
        if params[index].seal.viscosity_rate != extra_rate:
            extra_rate = params[index].seal.viscosity_rate
            thinning = math.exp(-(viscosity + extra_rate) * warmth)
        axes[index].thinning = thinning


@njit_law
def hydraulic_step(
    axes: Records[AxisState],
    params: Records[AxisParameters],
    given: Records[AxisInput],
    supply: SupplyState,
    unit: PowerUnit,
    dt: float,
    substeps: int,
) -> None:
    """Advance all axes and the power unit by dt in `substeps`, in place.

    axes[i].force becomes the mean force of the cylinder on its rod over dt, including friction and
    end force, which are also stored by themselves. An axis whose extension differs from the end of
    its last step (`reached`) is first moved there with its oil enclosed: coupling.py.
    """
    n = axes.shape[0]
    h = dt / substeps
    work = np.empty(n, AXIS_WORK)
    unit_work = np.empty(1, SUPPLY_WORK)  # handed on as an array, which keeps it alive
    openings, a, b = (
        np.empty((n, substeps + 1)),
        np.empty((n, substeps + 1)),
        np.empty((n, substeps + 1)),
    )
    warmth, loss = supply.temperature - unit.viscosity_reference, supply.loss
    pt = unit.tank_pressure
    open_valves(axes, params, given, h, openings)
    beyond = supply.temperature - unit.declared_at
    thin_oil(axes, params, unit.viscosity_rate, warmth, beyond)
    for index in range(n):
        begin(axes[index], params[index], given[index], h, work[index])
        a[index, 0], b[index, 0] = axes[index].a.pressure, axes[index].b.pressure
    demand_step(supply, unit, sensed_load(axes, openings, supply, unit), dt)
    begin_supply(supply, unit, unit_work)
    returned = heat = 0.0
    for k in range(substeps):
        drawn = rise = 0.0
        seen = supply.pressure + supply.droop
        for index in range(n):
            first_stage(
                axes[index],
                params[index],
                work[index],
                openings[index, k],
                openings[index, k + 1],
                seen,
                pt,
                h,
            )
            drawn += work[index].drawn
            rise += work[index].rise
        enthalpy = unit_work[0].enthalpy
        q, ahead = supply_first(supply, unit, unit_work, drawn, rise, h)
        seen = ahead + supply.droop + h * unit_work[0].droop_rate
        drawn = 0.0
        for index in range(n):
            second_stage(
                axes[index], params[index], work[index], openings[index, k + 1], q, seen, pt, h
            )
            drawn += work[index].drawn
        q = supply_second(supply, unit, unit_work, ahead, drawn, rise, h)
        enthalpy = 0.5 * (enthalpy + unit_work[0].enthalpy)
        back_all = warm_all = 0.0
        for index in range(n):
            back, warm = close_step(
                axes[index], params[index], work[index], q, enthalpy, unit_work[0].tank_enthalpy, h
            )
            a[index, k + 1], b[index, k + 1] = axes[index].a.pressure, axes[index].b.pressure
            back_all += back
            warm_all += warm
        returned += back_all
        heat += warm_all
    heat += rod_forces(axes, params, given, work, a, b, supply.time, dt)
    sense(axes, params, a, b, h)
    end_supply(supply, unit, unit_work, returned, heat, loss, dt)
