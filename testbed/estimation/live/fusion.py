"""The Kalman filter of the whole-body estimate: its unknowns, and how it learns them. Compiled.

The force computed from a cylinder's pressures is wrong by the zero of its sensors and by errors of
the believed friction: a constant for each direction of sliding, a share of the load across the rod,
and a deviation that changes with time. The balance of the body is wrong by errors of mass and
centre of mass, of rope directions and load pins, and of the angle at which the inertial unit is
mounted. `Unknowns` lists all of them. Most are constants; their prior standard deviations are the
tolerances of a machine as built, or the intervals of its commissioning. An unknown that no
observation depends on keeps its prior. Observed are (whole_body.py):
- the balance of the body: foot forces, weight, ropes and drill sum to zero, forces and moments (6
  equations);
- a foot in the air carries nothing (3 equations a leg); pistons that move in both directions then
  tell their zero from their friction;
- friction lies in its set: a deviation is cut off at the ends.
The unknown `balance` is a momentary error of the balance that decays within a fraction of a second:
without it a thousand balances in a row would make the filter certain of a wrong answer. Zeros have
heavy tails: where the balance blames one cylinder alone (faulty_sensor.py), its zero is freed, and
learnt from a prior as wide as the error that was found.
"""

from __future__ import annotations

import math

import numpy as np

from testbed.compiled import njit
from testbed.estimation.live import unknowns
from testbed.formats.arrays import Array
from testbed.formats.records import Record, part, quantity
from testbed.machine.names import AXES, LEGS

FREED_S = 30.0
"""A freed zero may change by its own size within this time: it may be a wrong gain (E)."""


class Sizes(Record):
    """How large the unknowns are expected to be, and how they move on over one step."""

    dt = quantity("s", "step")
    keep = quantity("1", "share of itself that a sliding piston's deviation keeps", per=AXES)
    spread = quantity("N", "standard deviation of a deviation", per=AXES)
    news = quantity(
        "N2", "variance that a resting piston's deviation gains, up to its spread's", per=AXES
    )
    alike = quantity(
        "1", "correlation of deviations of vertical pistons at rest; 0 while one slides", per=LEGS
    )
    zero_grown = quantity("N2", "by how much a zero's variance has grown", per=AXES)
    balance_keep = quantity("1", "share of itself that an error of the balance keeps")
    balance_sd = quantity(
        "N", "standard deviation of it as believed (moments N m)", per=unknowns.WRENCH
    )
    doubted_sd = quantity("N", "the same, larger where the balance is doubted", per=unknowns.WRENCH)
    low = quantity("N", "lower end of a deviation's set", per=AXES)
    high = quantity("N", "upper end of a deviation's set", per=AXES)
    zero_sd = quantity("N", "standard deviation of a zero by now", per=AXES)


class Suspicion(Record):
    """What the body's balance says of its sensors (faulty_sensor.py)."""

    missing = quantity(
        "N", "of the balance along z and about x and y (moments N m)", per=unknowns.VERTICAL_WRENCH
    )
    spread = quantity(
        "N2",
        "its covariance on a sound machine",
        per=(unknowns.VERTICAL_WRENCH, unknowns.VERTICAL_WRENCH),
    )
    known = quantity("N", "standard deviations of the unknowns beforehand", per=unknowns.NAMES)
    age = quantity("s", "for how long it has been looked at")
    memory = quantity("s", "over which means are taken")
    threshold = quantity("1", "standard deviations at which a sensor is blamed; 0: never")


class Fusion(Record):
    """The Kalman filter."""

    x = quantity("N", "Unknowns", per=unknowns.NAMES)
    p = quantity("N2", "their covariance", per=(unknowns.NAMES, unknowns.NAMES))
    fixed = quantity(
        "N2", "what of it the constants make, without noise", per=(unknowns.NAMES, unknowns.NAMES)
    )
    blamed = quantity("N", "size of a freed zero; 0: it is not freed", per=AXES)
    suspicion = part(Suspicion, "of its sensors")
    sizes = part(Sizes, "expected")


@njit
def is_freed(fusion: Fusion, i: int) -> bool:
    """Whether cylinder i's sensors carry the blame."""
    return bool(fusion.blamed[i] > 0.0)


@njit
def start(fusion: Fusion, known: Array) -> None:
    """Start from the prior; known: standard deviations of the CONSTANTS. A freed zero stays
    freed.
    """
    x, p, sizes = fusion.x, fusion.p, fusion.sizes
    for index in range(unknowns.COUNT):
        x[index] = 0.0
        for j in range(unknowns.COUNT):
            p[index, j] = fusion.fixed[index, j] = 0.0
    for index in range(len(unknowns.CONSTANTS)):
        p[index, index] = known[index] ** 2
        fusion.suspicion.known[index] = known[index]
    for index in range(len(AXES)):
        p[unknowns.ZERO + index, unknowns.ZERO + index] = (
            sizes.zero_sd[index] ** 2 + fusion.blamed[index] ** 2
        )
    for index in range(len(unknowns.CONSTANTS)):
        fusion.fixed[index, index] = p[index, index]
    for index in range(len(AXES)):
        p[unknowns.DEVIATION + index, unknowns.DEVIATION + index] = sizes.spread[index] ** 2
    for index in range(len(unknowns.WRENCH)):
        p[unknowns.BALANCE + index, unknowns.BALANCE + index] = sizes.doubted_sd[index] ** 2


@njit
def fade(fusion: Fusion, i: int, kept: float) -> None:
    """Let unknown i keep this share of itself."""
    fusion.x[i] *= kept
    for index in range(unknowns.COUNT):
        fusion.p[i, index] *= kept
        fusion.fixed[i, index] *= kept
    for index in range(unknowns.COUNT):
        fusion.p[index, i] *= kept
        fusion.fixed[index, i] *= kept


@njit
def predict(fusion: Fusion) -> None:
    """One step on: deviations and errors of the balance fade, and spread out to their expected
    sizes.
    """
    p, sizes = fusion.p, fusion.sizes
    for index in range(len(AXES)):
        d, z, spread = unknowns.DEVIATION + index, unknowns.ZERO + index, sizes.spread[index] ** 2
        fade(fusion, d, sizes.keep[index])
        p[d, d] = min(p[d, d] + sizes.news[index], max(spread, p[d, d]))
        p[d, d] += (1.0 - sizes.keep[index] ** 2) * spread
        grown = sizes.zero_grown[index] + fusion.blamed[index] ** 2 * sizes.dt / FREED_S
        p[z, z] += grown
        fusion.fixed[z, z] += grown
    for a in range(4):
        for b in range(a):
            i, j = 3 * a + 2, 3 * b + 2
            share = math.sqrt(sizes.alike[a] * sizes.alike[b])
            share *= 1.0 - sizes.keep[i] * sizes.keep[j]
            both = share * sizes.spread[i] * sizes.spread[j]
            p[unknowns.DEVIATION + i, unknowns.DEVIATION + j] += both
            p[unknowns.DEVIATION + j, unknowns.DEVIATION + i] += both
    for index in range(len(unknowns.WRENCH)):
        b = unknowns.BALANCE + index
        fade(fusion, b, sizes.balance_keep)
        p[b, b] += (1.0 - sizes.balance_keep**2) * sizes.doubted_sd[index] ** 2


@njit
def variance_of(fusion: Fusion, h: Array, r: float) -> float:
    """Variance of an observation h . x with variance r of its own, by what is known now."""
    for index in range(unknowns.COUNT):
        if h[index] != 0.0:
            for i in range(unknowns.COUNT):
                r += h[index] * fusion.p[index, i] * h[i]
    return r


@njit
def observe(fusion: Fusion, h: Array, y: float, r: float, gate: float, learns: bool) -> float:
    """Learn from h . x = y with variance r; beyond `gate` standard deviations r grows until it
    fits. Returns y - h . x over its standard deviation.

    learns: whether constants are learnt too. Otherwise they are considered states of a
    Schmidt-Kalman filter, all but freed zeros: they keep their values, and their uncertainty
    enters that of the others.
    """
    x, p, fixed = fusion.x, fusion.p, fusion.fixed
    ph, gain, fixed_h = np.zeros(unknowns.COUNT), np.zeros(unknowns.COUNT), np.zeros(unknowns.COUNT)
    variance, error, fixed_variance = r, y, 0.0
    for index in range(unknowns.COUNT):
        if h[index] != 0.0:  # many are
            for i in range(unknowns.COUNT):
                ph[i] += p[index, i] * h[index]
                fixed_h[i] += fixed[index, i] * h[index]
    for i in range(unknowns.COUNT):
        variance += h[i] * ph[i]
        fixed_variance += h[i] * fixed_h[i]
        error -= h[i] * x[i]
    score = error / math.sqrt(variance)
    if abs(score) > gate:
        variance = (error / gate) ** 2
    for i in range(unknowns.COUNT):
        if learns or i >= unknowns.DEVIATION or (i < unknowns.OUT and is_freed(fusion, i)):
            gain[i] = ph[i] / variance
            x[i] += gain[i] * error
    for i in range(unknowns.COUNT):
        rest = ph[i] - variance * gain[i]
        fixed_rest = fixed_h[i] - fixed_variance * gain[i]
        for index in range(unknowns.COUNT):
            p[i, index] -= gain[i] * ph[index] + rest * gain[index]
            fixed[i, index] -= gain[i] * fixed_h[index] + fixed_rest * gain[index]
    return score


@njit
def stay_in_sets(fusion: Fusion) -> None:
    """Bring deviations that lie outside their sets back to the ends. What they lose goes to the
    momentary error of the balance and to freed zeros, by their covariances with it, so that what
    was observed stays explained.
    """
    x, p, sizes = fusion.x, fusion.p, fusion.sizes
    for index in range(len(AXES)):
        k = unknowns.DEVIATION + index
        beyond = min(max(x[k], sizes.low[index]), sizes.high[index]) - x[k]
        if beyond != 0.0 and p[k, k] > 1.0:
            share = beyond / p[k, k]
            for j in range(unknowns.COUNT):
                if j >= unknowns.DEVIATION or (j < unknowns.OUT and is_freed(fusion, j)):
                    x[j] += p[j, k] * share
        p[k, k] = max(p[k, k], 1.0)
