"""The friction of a piston at rest: which value in the set is the likeliest, live.

Three things are known of it beside its bounds:
- It remembers: right after a stop it is what it was while sliding; creep and leakage let it drift towards the middle
  of the set within about half a second.
- While the valve is shut, the oil tells how far the piston is bent away: a load that changes by dF moves it by dx, the
  oil answers with k_oil dx = -dFp, k_oil = beta (A_A^2 / V_A + A_B^2 / V_B), the seal with k_seal dx. So friction
  changes by -(k_seal / k_oil) dFp, and the load by more than the pressures show. This is far below one encoder count.
- While the valve is open, oil flows into a chamber and the pressures change against friction, not against the load:
  friction takes a share OPEN_SHARE of dFp with it (the rest moves the piston), if that is the way the valve pushes: a
  piston that is about to slide keeps its friction when the pressures fall again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit

STATE_SIZE = 6
SLOW, BENT, SMOOTH, LAST, SHUT, STARTED = range(STATE_SIZE)
"""Remembered friction N, its quick part N, smoothed and last piston force N, share of time the valve is shut, 0/1."""

DRIFT_S, BENT_S, SMOOTH_S, SHUT_S = 0.4, 0.05, 0.004, 0.03
OPEN_SHARE = 0.8
SPREAD = 0.4
"""One standard deviation at rest as a share of the set's half width: what drift and vibration leave of it."""


@njit
def step(
    s: NDArray[np.float64],
    piston_n: float,
    low: float,
    high: float,
    slides: float,
    push: float,
    ratio: float,
    dt: float,
) -> float:
    """The likeliest friction in [low, high], N. `piston_n` = pA A_A - pB A_B; `ratio` = k_seal / k_oil;
    `push`: the way the open valve drives the piston, -1 or 1, 0 while it is shut.

    While the piston slides (slides > 0) the set is narrow and only remembered; at rest the three rules apply.
    """
    middle = 0.5 * (low + high)
    if not np.isfinite(piston_n):  # a sample is missing: nothing is learnt from it
        return float(s[SLOW] + s[BENT]) if s[STARTED] != 0.0 else middle
    if s[STARTED] == 0.0:
        s[SLOW], s[BENT], s[SMOOTH], s[LAST], s[SHUT], s[STARTED] = (
            middle,
            0.0,
            piston_n,
            piston_n,
            1.0,
            1.0,
        )
    smooth_change = (piston_n - s[SMOOTH]) * min(dt / SMOOTH_S, 1.0)
    s[SMOOTH] += smooth_change
    s[LAST] = piston_n
    s[SHUT] += ((1.0 if push == 0.0 else 0.0) - s[SHUT]) * min(dt / SHUT_S, 1.0)
    if slides > 0.0:
        s[SLOW] = min(max(s[SLOW] + s[BENT], low), high)
        s[BENT] = 0.0
        return float(s[SLOW])
    taken = push * max(push * smooth_change, 0.0) if push != 0.0 else smooth_change
    s[SLOW] += (1.0 - s[SHUT]) * OPEN_SHARE * taken + (middle - s[SLOW]) * min(dt / DRIFT_S, 1.0)
    s[SLOW] = min(max(s[SLOW], low), high)
    bend = -ratio * smooth_change
    room = max(0.0, 1.0 - s[BENT] / high) if bend > 0.0 else max(0.0, 1.0 - s[BENT] / low)
    s[BENT] += s[SHUT] * bend * room - s[BENT] * min(dt / BENT_S, 1.0)
    return float(min(max(s[SLOW] + s[BENT], low), high))


@njit
def oil_stiffness(
    x_m: float,
    stroke_m: float,
    area_a: float,
    area_b: float,
    dead_a: float,
    dead_b: float,
    bulk_pa: float,
) -> float:
    """k_oil = beta (A_A^2 / V_A + A_B^2 / V_B), N/m, ports shut; V_A = dead_a + A_A x, V_B = dead_b + A_B (L - x)."""
    inside = min(max(x_m, 0.0), stroke_m)
    volume_a, volume_b = dead_a + area_a * inside, dead_b + area_b * (stroke_m - inside)
    return bulk_pa * (area_a * area_a / volume_a + area_b * area_b / volume_b)
