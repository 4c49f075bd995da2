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
from testbed.formats.arrays import Array
from testbed.formats.records import Record, part, quantity
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.recording.rows import XYZ

WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
"""The six equations of the body's balance: forces along its axes, moments about them."""
VERTICAL_EQUATIONS = tuple(WRENCH.index(name) for name in ("fz", "tx", "ty"))
"""Places in WRENCH of the three equations that the vertical cylinders dominate."""
VERTICAL_WRENCH = tuple(WRENCH[place] for place in VERTICAL_EQUATIONS)


class Constants(Record):
    """What stays as it is while the machine works, each as the difference from what is believed."""

    zero = quantity("N", "what the sensors of a cylinder add to its force", per=AXES)
    out = quantity("N", "dry friction of a piston that slides out", per=AXES)
    back = quantity("N", "dry friction of a piston that slides in", per=AXES)
    side = quantity("1", "friction by the load across the rod", per=AXES)
    mass = quantity("kg", "mass of the machine")
    moment = quantity("kg m", "its first moment about the body's origin, body frame", per=XYZ)
    unit = quantity("rad", "how the inertial unit is turned on the body", per=("roll", "pitch"))
    azimuth = quantity("rad", "direction of a rope, about the body's z", per=SIDES)
    elevation = quantity("rad", "direction of a rope, towards the body's z", per=SIDES)
    pin_gain = quantity("1", "reading of a load pin by true tension", per=SIDES)
    pin_zero = quantity("N", "reading of a slack rope's load pin", per=SIDES)
    rope_height = quantity("m", "height at which a rope pulls", per=SIDES)


class Unknowns(Constants):
    """Everything that is learnt."""

    deviation = quantity("N", "friction less what all of that makes of it", per=AXES)
    balance = quantity("N", "momentary error of the body's balance (moments N m)", per=WRENCH)


NAMES, CONSTANTS = tuple(Unknowns.column_names()), tuple(Constants.column_names())
"""Every unknown in the filter's order, which begins with the constants."""
N = len(NAMES)


def place(name: str) -> int:
    """Where a quantity of `Unknowns` begins in the filter's vector."""
    return next(
        index
        for index, column in enumerate(NAMES)
        if column == name or column.startswith(name + "_")
    )


ZERO, OUT, BACK, SIDE = place("zero"), place("out"), place("back"), place("side")
MASS, MOMENT, UNIT = place("mass"), place("moment"), place("unit")
AZIMUTH, ELEVATION = place("azimuth"), place("elevation")
PIN_GAIN, PIN_ZERO, ROPE_HEIGHT = place("pin_gain"), place("pin_zero"), place("rope_height")
DEVIATION, BALANCE = place("deviation"), place("balance")
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
    balance_sd = quantity("N", "standard deviation of it as believed (moments N m)", per=WRENCH)
    doubted_sd = quantity("N", "the same, larger where the balance is doubted", per=WRENCH)
    low = quantity("N", "lower end of a deviation's set", per=AXES)
    high = quantity("N", "upper end of a deviation's set", per=AXES)
    zero_sd = quantity("N", "standard deviation of a zero by now", per=AXES)


class Suspicion(Record):
    """What the body's balance says of its sensors (faulty_sensor.py)."""

    missing = quantity(
        "N", "of the balance along z and about x and y (moments N m)", per=VERTICAL_WRENCH
    )
    spread = quantity(
        "N2", "its covariance on a sound machine", per=(VERTICAL_WRENCH, VERTICAL_WRENCH)
    )
    known = quantity("N", "standard deviations of the unknowns beforehand", per=NAMES)
    age = quantity("s", "for how long it has been looked at")
    memory = quantity("s", "over which means are taken")
    threshold = quantity("1", "standard deviations at which a sensor is blamed; 0: never")


class Fusion(Record):
    """The Kalman filter."""

    x = quantity("N", "Unknowns", per=NAMES)
    p = quantity("N2", "their covariance", per=(NAMES, NAMES))
    fixed = quantity("N2", "what of it the constants make, without noise", per=(NAMES, NAMES))
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
    for index in range(N):
        x[index] = 0.0
        for j in range(N):
            p[index, j] = fusion.fixed[index, j] = 0.0
    for index in range(len(CONSTANTS)):
        p[index, index] = known[index] ** 2
        fusion.suspicion.known[index] = known[index]
    for index in range(len(AXES)):
        p[ZERO + index, ZERO + index] = sizes.zero_sd[index] ** 2 + fusion.blamed[index] ** 2
    for index in range(len(CONSTANTS)):
        fusion.fixed[index, index] = p[index, index]
    for index in range(len(AXES)):
        p[DEVIATION + index, DEVIATION + index] = sizes.spread[index] ** 2
    for index in range(len(WRENCH)):
        p[BALANCE + index, BALANCE + index] = sizes.doubted_sd[index] ** 2


@njit
def fade(fusion: Fusion, i: int, kept: float) -> None:
    """Let unknown i keep this share of itself."""
    fusion.x[i] *= kept
    for index in range(N):
        fusion.p[i, index] *= kept
        fusion.fixed[i, index] *= kept
    for index in range(N):
        fusion.p[index, i] *= kept
        fusion.fixed[index, i] *= kept


@njit
def predict(fusion: Fusion) -> None:
    """One step on: deviations and errors of the balance fade, and spread out to their expected
    sizes.
    """
    p, sizes = fusion.p, fusion.sizes
    for index in range(len(AXES)):
        d, z, spread = DEVIATION + index, ZERO + index, sizes.spread[index] ** 2
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
            p[DEVIATION + i, DEVIATION + j] += both
            p[DEVIATION + j, DEVIATION + i] += both
    for index in range(len(WRENCH)):
        b = BALANCE + index
        fade(fusion, b, sizes.balance_keep)
        p[b, b] += (1.0 - sizes.balance_keep**2) * sizes.doubted_sd[index] ** 2


@njit
def variance_of(fusion: Fusion, h: Array, r: float) -> float:
    """Variance of an observation h . x with variance r of its own, by what is known now."""
    for index in range(N):
        if h[index] != 0.0:
            for i in range(N):
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
    ph, gain, fixed_h = np.zeros(N), np.zeros(N), np.zeros(N)
    variance, error, fixed_variance = r, y, 0.0
    for index in range(N):
        if h[index] != 0.0:  # many are
            for i in range(N):
                ph[i] += p[index, i] * h[index]
                fixed_h[i] += fixed[index, i] * h[index]
    for i in range(N):
        variance += h[i] * ph[i]
        fixed_variance += h[i] * fixed_h[i]
        error -= h[i] * x[i]
    score = error / math.sqrt(variance)
    if abs(score) > gate:
        variance = (error / gate) ** 2
    for i in range(N):
        if learns or i >= DEVIATION or (i < OUT and is_freed(fusion, i)):
            gain[i] = ph[i] / variance
            x[i] += gain[i] * error
    for i in range(N):
        rest = ph[i] - variance * gain[i]
        fixed_rest = fixed_h[i] - fixed_variance * gain[i]
        for index in range(N):
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
        k = DEVIATION + index
        beyond = min(max(x[k], sizes.low[index]), sizes.high[index]) - x[k]
        if beyond != 0.0 and p[k, k] > 1.0:
            share = beyond / p[k, k]
            for j in range(N):
                if j >= DEVIATION or (j < OUT and is_freed(fusion, j)):
                    x[j] += p[j, k] * share
        p[k, k] = max(p[k, k], 1.0)
