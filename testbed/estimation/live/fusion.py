"""Four legs, one body: what each cylinder's force is off by, learnt from what must balance. Compiled.

A cylinder's force is off by a zero (thermal, constant) and by what friction deviates from its likeliest value (inside
its set). Three things are known of them:
- the body's balance: foot forces, weight, ropes and drill add up to nothing, forces and moments (6 equations);
- a foot in the air carries nothing (3 equations a leg): moving both ways, this tells the zero from friction;
- friction stays in its set: the deviation is cut off at its ends.
A Kalman filter over `Unknowns` keeps what is learnt and how sure it is; `balance` is what the body's balance itself
is off by (weight, centre of mass, rope directions, drill): known to a standard deviation, and never zero, so that a
thousand balances do not make a certainty. Zeros have heavy tails: what stays far beyond its expected size is widened
until one sensor carries the blame, not all of them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.formats.records import Record, part, quantity
from testbed.machine.names import AXES

WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")


class Unknowns(Record):
    """What is learnt."""

    zero = quantity("N", "constant error of a cylinder's force", per=AXES)
    deviation = quantity("N", "friction less its likeliest value", per=AXES)
    balance = quantity("N", "error of the body's balance (moments N m)", per=WRENCH)


NAMES = tuple(Unknowns.column_names())
N = len(NAMES)
ZERO = NAMES.index(f"zero_{AXES[0]}")
DEVIATION = NAMES.index(f"deviation_{AXES[0]}")
BALANCE = NAMES.index(f"balance_{WRENCH[0]}")
"""Where each of them begins in the filter's vector."""


class Sizes(Record):
    """How large the unknowns are expected to be, and how they move on over one step."""

    dt = quantity("s", "step")
    keep = quantity("1", "share of itself that a deviation keeps", per=AXES)
    spread = quantity("N", "standard deviation of a deviation", per=AXES)
    news = quantity(
        "N2", "variance that a piston's change of force adds to its deviation", per=AXES
    )
    zero_sd = quantity("N", "standard deviation of a zero", per=AXES)
    zero_grown = quantity("N2", "by how much a zero's variance has grown", per=AXES)
    balance_keep = quantity("1", "share of itself that an error of the balance keeps")
    balance_sd = quantity("N", "standard deviation of it (moments N m)", per=WRENCH)
    low = quantity("N", "lower end of a deviation's set", per=AXES)
    high = quantity("N", "upper end of a deviation's set", per=AXES)
    tail = quantity("s", "within it a zero beyond twice its size is set free; 0: never")


class Fusion(Record):
    """The Kalman filter."""

    x = quantity("N", "Unknowns", per=NAMES)
    p = quantity("N2", "their covariance", per=(NAMES, NAMES))
    sizes = part(Sizes, "expected")


@njit
def start(fusion: Any) -> None:
    """Nothing is known beyond the expected sizes."""
    x, p, sizes = fusion.x, fusion.p, fusion.sizes
    for i in range(N):
        x[i] = 0.0
        for j in range(N):
            p[i, j] = 0.0
    for i in range(12):
        p[ZERO + i, ZERO + i] = sizes.zero_sd[i] ** 2
        p[DEVIATION + i, DEVIATION + i] = sizes.spread[i] ** 2
    for i in range(6):
        p[BALANCE + i, BALANCE + i] = sizes.balance_sd[i] ** 2


@njit
def keep_of(sizes: Any, i: int) -> float:
    """Share of itself that unknown i keeps."""
    if i >= BALANCE:
        return float(sizes.balance_keep)
    return float(sizes.keep[i - DEVIATION]) if i >= DEVIATION else 1.0


@njit
def predict(fusion: Any) -> None:
    """One step on: deviations and errors of the balance fade, and spread out to their expected sizes."""
    x, p, sizes = fusion.x, fusion.p, fusion.sizes
    for i in range(N):
        kept = keep_of(sizes, i)
        x[i] *= kept
        for j in range(N):
            p[i, j] *= kept * keep_of(sizes, j)
    for i in range(12):
        d, z, spread = DEVIATION + i, ZERO + i, sizes.spread[i] ** 2
        p[d, d] = min(p[d, d] + sizes.news[i], max(spread, p[d, d]))
        p[d, d] += (1.0 - sizes.keep[i] ** 2) * spread
        p[z, z] += sizes.zero_grown[i]
        if sizes.tail > 0.0 and abs(x[z]) > 2.0 * sizes.zero_sd[i]:
            p[z, z] += x[z] ** 2 * sizes.dt / sizes.tail
    for i in range(6):
        b = BALANCE + i
        p[b, b] += (1.0 - sizes.balance_keep**2) * sizes.balance_sd[i] ** 2


@njit
def observe(fusion: Any, h: Any, y: float, r: float, gate: float) -> float:
    """Learn from h . x = y with variance r; beyond `gate` standard deviations r grows until it fits. Returns y - h . x
    over its standard deviation.
    """
    x, p = fusion.x, fusion.p
    ph = np.zeros(N)
    variance, error = r, y
    for j in range(N):
        if h[j] != 0.0:  # most are
            for i in range(N):
                ph[i] += p[i, j] * h[j]
    for i in range(N):
        variance += h[i] * ph[i]
        error -= h[i] * x[i]
    score = error / math.sqrt(variance)
    if abs(score) > gate:
        variance = (error / gate) ** 2
    gain = 1.0 / variance
    for i in range(N):
        k = ph[i] * gain
        x[i] += k * error
        for j in range(N):
            p[i, j] -= k * ph[j]
    return score


@njit
def stay_in_sets(fusion: Any) -> None:
    """Cut deviations off at the ends of their sets; what lay outside is known no better."""
    x, p, sizes = fusion.x, fusion.p, fusion.sizes
    for i in range(12):
        k = DEVIATION + i
        if x[k] < sizes.low[i]:
            x[k] = sizes.low[i]
        elif x[k] > sizes.high[i]:
            x[k] = sizes.high[i]
        p[k, k] = max(p[k, k], 1.0)
