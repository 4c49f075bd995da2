"""Speed and acceleration from a quantised encoder, live: a third-order observer and a record of the last counts.

The encoder steps by 0.1 mm, so one count within 1 ms would read as 0.1 m/s. The observer (a Butterworth pattern of
three poles) gives v and a; the counts themselves say whether the piston moves, and which way.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit

STATE_SIZE = 9
X, V, A, LAST, SINCE, DIRECTION, RUN, STARTED, GAP = range(STATE_SIZE)
"""m, m/s, m/s2, last reading m, time since it changed s, sign of that change, changes in that sense, 0/1; the time
between the last two changes, for each count of the later one, s."""
OVERDUE_S = 2.0e-3
"""Two samples: at high speed the time between two counts is known no better."""


@njit
def observe(
    s: NDArray[np.float64], reading_m: float, resolution_m: float, dt_s: float, w_rad_s: float
) -> None:
    """Take one encoder reading into the state s.

    x, v, a are predicted over dt with constant a and corrected with gains 2 w dt, 2 w^2 dt, w^3 dt.
    `w` = 60 rad/s keeps the ripple of 0.1 mm steps below 2 mm/s and 0.15 m/s2.
    """
    if not np.isfinite(reading_m):  # a reading is missing: coast
        s[SINCE] += dt_s
        return
    if s[STARTED] == 0.0:
        for k in range(s.shape[0]):
            s[k] = 0.0
        s[X], s[LAST], s[SINCE], s[STARTED] = reading_m, reading_m, 1.0e3, 1.0
    s[X] += dt_s * (s[V] + 0.5 * dt_s * s[A])
    s[V] += dt_s * s[A]
    error = reading_m - s[X]
    s[X] += 2.0 * w_rad_s * dt_s * error
    s[V] += 2.0 * w_rad_s * w_rad_s * dt_s * error
    s[A] += w_rad_s**3 * dt_s * error
    count_changes(s, reading_m, resolution_m, dt_s)


@njit
def count_changes(
    s: NDArray[np.float64], reading_m: float, resolution_m: float, dt_s: float
) -> None:
    """Keep when the reading last changed, in which sense, and for how many counts running in that sense."""
    counts = (reading_m - s[LAST]) / resolution_m
    s[SINCE] += dt_s
    if abs(counts) < 0.5:
        return
    sense = 1.0 if counts > 0.0 else -1.0
    s[RUN] = (s[RUN] if sense == s[DIRECTION] else 0.0) + abs(counts)
    s[DIRECTION], s[LAST], s[GAP], s[SINCE] = sense, reading_m, s[SINCE] / abs(counts), 0.0


@njit
def bounded_speed(s: NDArray[np.float64], resolution_m: float, rest_m_s: float) -> float:
    """The observer's speed in m/s, no faster than the silence of the encoder allows: |v| <= 1.5 count / silence.

    Exactly 0 once that bound is below `rest`: a piston that shows no count stands still.
    """
    limit = 1.5 * resolution_m / max(s[SINCE], 1.0e-6)
    return float(min(max(s[V], -limit), limit)) if limit > rest_m_s else 0.0


@njit
def sliding(s: NDArray[np.float64], resolution_m: float, slow_m_s: float, fast_m_s: float) -> float:
    """How surely the piston slides in `s[DIRECTION]`: 0 (may be at rest) .. 1 (slides).

    One count to and fro is no motion: two counts running in one sense are asked for. Then the time between them, or
    since the last one if that is longer, bounds the speed, 0 below `slow`, 1 above `fast`. A count that is overdue by
    more than the last gap tells of a stop.
    """
    if s[RUN] < 1.5:
        return 0.0
    bound = resolution_m / max(s[SINCE], s[GAP], 1.0e-6)
    overdue = 3.0 - s[SINCE] / (s[GAP] + OVERDUE_S)
    return float(min(1.0, max(0.0, min(overdue, (bound - slow_m_s) / (fast_m_s - slow_m_s)))))
