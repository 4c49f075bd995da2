"""Surprise: by how much the machine differs from what is believed of it more than its tolerances,
or its commissioning, allow. Compiled.

Each unknown of the filter has a prior standard deviation s. If the machine is as believed, the
estimate x and the posterior variance P satisfy

    mean of sum (x / s)^2  =  sum (1 - P / s^2)

whatever is observed; an unknown that nothing reveals adds nothing to either side. On a machine with
an undeclared half tonne, or with ropes three degrees from where they were surveyed, the left side
is larger. Let all s^2 be too small by one common factor. With an inverse gamma prior that weighs as
much as `worth` unknowns, the posterior mean of that factor is about

    surprise = (worth + sum (x / s)^2) / (worth + sum (1 - P / s^2))

Constants enter as they are now; friction's deviations at the vertical pistons and the errors of the
balance enter as means over `memory`. Where the surprise exceeds 1, intervals are wider by its
square root. A freed zero (faulty_sensor.py) is explained, and left out.
"""

from __future__ import annotations

import math

from testbed.compiled import njit
from testbed.estimation.live import unknowns
from testbed.estimation.live.fusion import Fusion, is_freed
from testbed.estimation.live.unknowns import VERTICAL_EQUATIONS
from testbed.formats.records import Record, quantity
from testbed.machine.names import VERTICAL

NONE = 1.0
"""The machine is as believed."""


class SurpriseNumbers(Record):
    """How readily the machine is believed to be otherwise."""

    worth = quantity("1", "unknowns that the belief is worth, 0: never surprised")
    memory = quantity("s", "over which momentary deviations are looked at")


class SurpriseState(Record):
    """What was found of momentary deviations."""

    found = quantity("1", "mean sum of their squares over their variances")
    expected = quantity("1", "what a machine as believed would make of it")
    age = quantity("s", "for how long they have been looked at")
    level = quantity("1", "the surprise; 0 before the first balance")


@njit
def share_found(deviation: float, left: float, before: float) -> tuple[float, float]:
    """(x / s)^2 and 1 - P / s^2 of an unknown: what is found of it, variance left and before; 0
    and 0 where it was known.
    """
    if before <= 0.0:
        return 0.0, 0.0
    return deviation**2 / before, min(max(1.0 - left / before, 0.0), 1.0)


@njit
def of_constants(fusion: Fusion) -> tuple[float, float]:
    """Sums over the machine's constants."""
    x, p, known, sizes = fusion.x, fusion.p, fusion.suspicion.known, fusion.sizes
    found = expected = 0.0
    for index in range(len(unknowns.CONSTANTS)):
        before = known[index] ** 2
        if index < unknowns.OUT:
            before = 0.0 if is_freed(fusion, index) else sizes.zero_sd[index] ** 2
        square, share = share_found(x[index], p[index, index], before)
        found += square
        expected += share
    return found, expected


@njit
def of_moment(fusion: Fusion) -> tuple[float, float]:
    """Sums over friction's deviations at the vertical pistons, and the errors of the balance that
    vertical cylinders make up.
    """
    x, p, sizes = fusion.x, fusion.p, fusion.sizes
    found = expected = 0.0
    for cylinder in VERTICAL:
        k = unknowns.DEVIATION + cylinder
        square, share = share_found(x[k], p[k, k], sizes.spread[cylinder] ** 2)
        found += square
        expected += share
    for equation in VERTICAL_EQUATIONS:
        k = unknowns.BALANCE + equation
        square, share = share_found(x[k], p[k, k], sizes.doubted_sd[equation] ** 2)
        found += square
        expected += share
    return found, expected


@njit
def follow_surprise(fusion: Fusion, numbers: SurpriseNumbers, state: SurpriseState) -> None:
    """Update the surprise after one balance."""
    if numbers.worth <= 0.0:
        state.level = NONE
        return
    dt = fusion.sizes.dt
    state.age += dt
    share = dt / min(state.age, numbers.memory)
    found, expected = of_moment(fusion)
    if math.isfinite(found) and math.isfinite(expected):
        state.found += share * (found - state.found)
        state.expected += share * (expected - state.expected)
    found, expected = of_constants(fusion)
    seen = numbers.worth + found + state.found
    as_believed = numbers.worth + expected + state.expected
    state.level = max(seen / as_believed, NONE)


@njit
def widening(state: SurpriseState) -> float:
    """By how much intervals are wider for it, 1 or more."""
    return math.sqrt(max(state.level, NONE))
