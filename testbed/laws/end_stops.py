"""Forces along the stroke beside oil and friction: end cushions, stops, and what a scenario hangs
on the piston.

All are means over a step at constant rate, in closed form: a stiff stop met within a step is not
missed.
"""

from __future__ import annotations

import math

from testbed.compiled import njit_law
from testbed.formats.records import Record, quantity


class EndParameters(Record):
    """Cushions and stops, alike at both ends of the stroke."""

    cushion_length = quantity("m", "over which the cushion brakes")
    cushion_damping = quantity("N s/m", "of the cushion at its end")
    stop_stiffness = quantity("N/m", "of the stop behind it")
    stop_damping = quantity("N s/m", "of the stop")


class ExtraForces(Record):
    """What a scenario hangs on a piston without declaring it."""

    spring_stiffness = quantity("N/m", "of a spring on the rod")
    spring_rest = quantity("m", "extension at which that spring is at rest")
    periodic_force = quantity("N", "amplitude of a narrow-band force")
    periodic_frequency = quantity("rad/s", "its frequency")
    cushion_stiffness = quantity("N/m", "of a soft cushion before the inner end")
    cushion_start = quantity("m", "extension at which that cushion begins")


@njit_law
def mean_ramp(start: float, end: float) -> float:
    """Mean of max(0, y) while y runs evenly from `start` to `end`."""
    if start >= 0.0 and end >= 0.0:
        return 0.5 * (start + end)
    if start <= 0.0 and end <= 0.0:
        return 0.0
    high = start if start > end else end
    return 0.5 * high * high / abs(end - start)


@njit_law
def share_above(start: float, end: float) -> float:
    """Share of the time in which y > 0 while y runs evenly from `start` to `end`."""
    if start > 0.0 and end > 0.0:
        return 1.0
    if start <= 0.0 and end <= 0.0:
        return 0.0
    high = start if start > end else end
    return high / abs(end - start)


@njit_law
def one_end(p: EndParameters, gap: float, gap_end: float, approach: float) -> float:
    """Mean push away from one end, N, >= 0: a damper growing over the cushion's length, then a
    stop.

    gap, gap_end: distance to the end at start and end of the step, m (negative: into the stop);
    approach: rate towards it, m/s. The cushion works against approach only; the stop's damper never
    pulls.
    """
    force = 0.0
    length, stiffness = p.cushion_length, p.stop_stiffness
    if approach > 0.0:
        force = p.cushion_damping * approach / length * mean_ramp(length - gap, length - gap_end)
        force += p.stop_damping * approach * share_above(-gap, -gap_end)
        return force + stiffness * mean_ramp(-gap, -gap_end)
    if stiffness <= 0.0:
        return 0.0
    relief = p.stop_damping * approach / stiffness
    return stiffness * mean_ramp(relief - gap, relief - gap_end)


@njit_law(forceinline=True)
def end_force(
    p: EndParameters, stroke: float, x: float, v: float, speed: float, dt: float
) -> float:
    """Mean force of cushions and stops over dt, N, along +x.

    x: extension at the step's start, m, which changes at the rate v, m/s; speed: what dampers see
    of the rate, m/s (coupling.py).
    """
    end = x + v * dt
    low, high = (x, end) if x < end else (end, x)
    force = 0.0
    if low < p.cushion_length:
        force = one_end(p, x, end, -speed)
    if stroke - high < p.cushion_length:
        force -= one_end(p, stroke - x, stroke - end, speed)
    return force


@njit_law
def extra_force(p: ExtraForces, x: float, v: float, t: float, dt: float) -> float:
    """Mean over [t, t + dt] of the undeclared forces on the piston along +x, N: spring, narrow
    band, early cushion.
    """
    force = 0.0
    if p.spring_stiffness != 0.0:
        force -= p.spring_stiffness * (x + 0.5 * v * dt - p.spring_rest)
    if p.periodic_force != 0.0 and p.periodic_frequency > 0.0:
        w = p.periodic_frequency
        force += p.periodic_force * (math.cos(w * t) - math.cos(w * (t + dt))) / (w * dt)
    if p.cushion_stiffness != 0.0:
        force += p.cushion_stiffness * mean_ramp(p.cushion_start - x, p.cushion_start - x - v * dt)
    return force
