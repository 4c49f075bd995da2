"""Forces along the stroke beside oil and friction: end cushions, stops, and what a scenario hangs on the piston.

All are means over a step at constant rate, in closed form: a stiff stop met within a step is not missed.
"""

from __future__ import annotations

import math
from typing import Any

from testbed.laws import columns as c
from testbed.laws.compiling import njit_law


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
def one_end(
    gap: float,
    gap_end: float,
    approach: float,
    length: float,
    cushion: float,
    stiffness: float,
    damping: float,
) -> float:
    """Mean push away from one end, N, >= 0: a damper growing over the last `length`, then a stop.

    gap, gap_end: distance to the end at start and end of the step, m (negative: into the stop); approach: rate towards
    it, m/s. The cushion works against approach only; the stop's damper never pulls.
    """
    force = 0.0
    if approach > 0.0:
        force = cushion * approach / length * mean_ramp(length - gap, length - gap_end)
        force += damping * approach * share_above(-gap, -gap_end)
        return float(force + stiffness * mean_ramp(-gap, -gap_end))
    if stiffness <= 0.0:
        return 0.0
    relief = damping * approach / stiffness
    return float(stiffness * mean_ramp(relief - gap, relief - gap_end))


@njit_law(forceinline=True)
def end_force(p: Any, x: float, v: float, dt: float) -> float:
    """Mean force of cushions and stops over dt, N, along +x; x at the step's start, p: AXIS_PARAMETERS."""
    end = x + v * dt
    length, stroke = p[c.CUSHION_LENGTH], p[c.STROKE]
    low, high = (x, end) if x < end else (end, x)
    force = 0.0
    if low < length:
        force = one_end(x, end, -v, length, p[c.CUSHION_D], p[c.STOP_K], p[c.STOP_D])
    if stroke - high < length:
        force -= one_end(
            stroke - x, stroke - end, v, length, p[c.CUSHION_D], p[c.STOP_K], p[c.STOP_D]
        )
    return force


@njit_law
def extra_force(p: Any, x: float, v: float, t: float, dt: float) -> float:
    """Mean over [t, t + dt] of undeclared forces on the piston along +x, N: spring, narrow band, early cushion."""
    force = 0.0
    if p[c.SPRING_K] != 0.0:
        force -= p[c.SPRING_K] * (x + 0.5 * v * dt - p[c.SPRING_REST])
    if p[c.PERIODIC_N] != 0.0 and p[c.PERIODIC_W] > 0.0:
        w = p[c.PERIODIC_W]
        force += p[c.PERIODIC_N] * (math.cos(w * t) - math.cos(w * (t + dt))) / (w * dt)
    if p[c.XCUSHION_K] != 0.0:
        force += p[c.XCUSHION_K] * mean_ramp(
            p[c.XCUSHION_START] - x, p[c.XCUSHION_START] - x - v * dt
        )
    return force
