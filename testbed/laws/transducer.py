"""Pressure transducers of one axis: a first-order lag each; B sits behind a pipe with its own
resonance.
"""

from __future__ import annotations

from testbed.compiled import njit_law
from testbed.formats.arrays import Array
from testbed.formats.records import Record, quantity
from testbed.laws.second_order import lag_weights, second_order


class TransducerParameters(Record):
    """The transducers of one axis."""

    pipe_frequency = quantity("rad/s", "natural frequency of the pipe to B's transducer")
    pipe_damping = quantity("1", "damping ratio of that pipe")
    lag = quantity("s", "time constant of each transducer")


class TransducerState(Record):
    """What stands at the transducers of one axis, absolute."""

    a = quantity("Pa", "what A's transducer shows, before its own errors")
    b = quantity("Pa", "what B's transducer shows, before its own errors")
    pipe_pressure = quantity("Pa", "pressure at the end of B's pipe")
    pipe_rate = quantity("Pa/s", "its rate")


@njit_law
def transducer_weights(
    line_wn: float, line_zeta: float, tau: float, h: float
) -> tuple[float, float, float, float, float, float]:
    """Exact step of line and lag over h for a pressure that ramps evenly."""
    yy, yr, ry, rr = second_order(line_wn, line_zeta, h)
    old, rise = lag_weights(tau, h)
    return yy, yr, ry, rr, old, rise


@njit_law(forceinline=True)
def sense_path(
    s: TransducerState,
    p: TransducerParameters,
    a: Array,
    b: Array,
    h: float,
    weights: tuple[float, float, float, float, float, float],
) -> None:
    """Advance the transducers of one axis along the pressures a, b (n + 1, Pa) at the ends of n
    substeps of h.

    weights: of `transducer_weights`.
    """
    yy, yr, ry, rr, old, rise = weights
    behind = 2.0 * p.pipe_damping / p.pipe_frequency
    line, rate, sensed_a, sensed_b = s.pipe_pressure, s.pipe_rate, s.a, s.b
    fresh = 1.0 - old
    for index in range(a.shape[0] - 1):
        sensed_a = old * sensed_a + fresh * a[index] + rise * (a[index + 1] - a[index])
        ramp = (b[index + 1] - b[index]) / h
        before = line
        y, y_rate = line - b[index] + behind * ramp, rate - ramp
        line = b[index + 1] - behind * ramp + yy * y + yr * y_rate
        rate = ramp + ry * y + rr * y_rate
        sensed_b = old * sensed_b + fresh * before + rise * (line - before)
    s.pipe_pressure, s.pipe_rate, s.a, s.b = line, rate, sensed_a, sensed_b
