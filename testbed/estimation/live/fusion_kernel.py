"""Four legs, one body: what each cylinder's force is off by, learnt from what must balance. Compiled.

A cylinder's force is off by a zero z (thermal, constant) and by what friction deviates from its likeliest value, d
(inside its set). Three things are known of them:
- the body's balance: foot forces, weight, ropes and drill add up to nothing, forces and moments (6 equations);
- a foot in the air carries nothing (3 equations a leg): moving both ways, this tells the zero from friction;
- friction stays in its set: d is cut off at its ends.
A Kalman filter over (z[12], d[12], b[6]) keeps what is learnt and how sure it is; b is what the body's balance itself
is off by (weight, centre of mass, rope directions, drill): known to a standard deviation, and never zero, so that a
thousand balances do not make a certainty. z has heavy tails: what stays far beyond its expected size is widened until
one sensor carries the blame, not all of them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit

Array = NDArray[np.float64]
N = 30
Z, D, B = 0, 12, 24


@njit
def start(x: Array, p: Array, zero_sd: Array, spread: Array, body_sd: Array) -> None:
    """Nothing is known beyond the expected sizes: x (30), p (30, 30)."""
    x[:] = 0.0
    p[:, :] = 0.0
    for i in range(12):
        p[Z + i, Z + i] = zero_sd[i] ** 2
        p[D + i, D + i] = spread[i] ** 2
    for i in range(6):
        p[B + i, B + i] = body_sd[i] ** 2


@njit
def predict(
    x: Array,
    p: Array,
    keep: Array,
    spread: Array,
    news: Array,
    zero_sd: Array,
    zero_grown: Array,
    body_sd: Array,
    body_keep: float,
    dt: float,
    tail_s: float,
) -> None:
    """Over dt: d keeps the share keep[12] of itself and spreads out to spread[12] N, b likewise to body_sd[6].

    news[12] is variance that a piston's change of force adds, N2. zero_sd[12] is the expected size of z, zero_grown[12]
    by how much its variance has grown since, N2. A z beyond twice its expected size is set free within tail_s seconds
    (0: never).
    """
    f = np.ones(N)
    for i in range(12):
        f[D + i] = keep[i]
    for i in range(B, N):
        f[i] = body_keep
    for i in range(N):
        x[i] *= f[i]
        for j in range(N):
            p[i, j] *= f[i] * f[j]
    for i in range(12):
        p[D + i, D + i] = min(p[D + i, D + i] + news[i], max(spread[i] ** 2, p[D + i, D + i]))
        p[D + i, D + i] += (1.0 - keep[i] ** 2) * spread[i] ** 2
        p[Z + i, Z + i] += zero_grown[i]
        if tail_s > 0.0 and abs(x[Z + i]) > 2.0 * zero_sd[i]:
            p[Z + i, Z + i] += x[Z + i] ** 2 * dt / tail_s
    for i in range(6):
        p[B + i, B + i] += (1.0 - body_keep**2) * body_sd[i] ** 2


@njit
def observe(x: Array, p: Array, h: Array, y: float, r: float, gate: float) -> float:
    """Learn from h . x = y with variance r; beyond `gate` standard deviations r grows until it fits. Returns y - h . x
    over its standard deviation."""
    ph = np.zeros(N)
    s, error = r, y
    for j in range(N):
        if h[j] != 0.0:  # most are
            for i in range(N):
                ph[i] += p[i, j] * h[j]
    for i in range(N):
        s += h[i] * ph[i]
        error -= h[i] * x[i]
    score = error / math.sqrt(s)
    if abs(score) > gate:
        s = (error / gate) ** 2
    gain = 1.0 / s
    for i in range(N):
        k = ph[i] * gain
        x[i] += k * error
        for j in range(N):
            p[i, j] -= k * ph[j]
    return score


@njit
def stay_in_sets(x: Array, p: Array, low: Array, high: Array) -> None:
    """Cut d off at low[12], high[12] (N, seen from the likeliest friction); what lay outside is known no better."""
    for i in range(12):
        k = D + i
        if x[k] < low[i]:
            x[k] = low[i]
        elif x[k] > high[i]:
            x[k] = high[i]
        p[k, k] = max(p[k, k], 1.0)
