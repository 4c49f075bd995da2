"""Two equal one-pole low-passes in a row over samples that have arrived, however far apart: the
impulse response has the standard deviation `width_s`. Each is y = p y + (1 - p) x, whose pole p is
that of the time since the sample before.
"""

from __future__ import annotations

import numpy as np

from testbed.compiled import njit
from testbed.formats.arrays import Array

USUAL_SHARE = 0.02
"""Steps within this share of the usual one are the usual one, read by a clock that is not exact."""
LEAST_WIDTH = 0.3
"""Of the impulse response, in usual steps."""


def steps_of(time_s: Array, usual_s: float) -> Array:
    """Time since the sample before, s, (n,); before the first one a usual step."""
    steps = np.diff(time_s, prepend=time_s[:1] - usual_s)
    return np.where(np.abs(steps - usual_s) < USUAL_SHARE * usual_s, usual_s, steps)


def causal_slope(values: Array, steps_s: Array) -> Array:
    """Change from the sample before, (n,), per second; none at the first one."""
    return np.asarray(np.diff(values, prepend=values[:1]) * (1.0 / steps_s), dtype=np.float64)


def low_passed(
    values: Array, steps_s: Array, usual_s: float, width_s: float, slope: float = 0.0
) -> Array:
    """`values` (n,) low-passed. Before the first one they came on a straight line of this `slope`,
    per second.
    """
    width_s = max(width_s, LEAST_WIDTH * usual_s)
    return np.asarray(
        _low_passed(np.asarray(values, dtype=np.float64), steps_s, usual_s, width_s, slope),
        dtype=np.float64,
    )


@njit
def _low_passed(
    values: Array, steps_s: Array, usual_s: float, width_s: float, slope: float
) -> Array:
    out = np.empty(values.size)
    pole = np.exp(-np.sqrt(2.0) * usual_s / width_s)
    late_s = usual_s * pole / (1.0 - pole)
    fed = values[0] - slope * usual_s
    first, second = fed - slope * late_s, fed - 2.0 * slope * late_s
    for index in range(values.size):
        pole = np.exp(-np.sqrt(2.0) * steps_s[index] / width_s)
        first = pole * first + (1.0 - pole) * values[index]
        second = pole * second + (1.0 - pole) * first
        out[index] = second
    return out
