"""Whether something that no sensor measures carries the body: its belly, a prop under it. Compiled.

Feet, ropes and drill then do not add up to the weight. The residual of the balance is an upward
force, far larger than its uncertainty, whose line of action runs through the belly. (A sensor that
reads wrong leaves a force at its own foot, outside the belly: see faulty_sensor.py.) While
something else carries, the balance says nothing about the feet: it is not used, and each foot is as
uncertain as its own cylinders leave it. While that is only suspected, constants are not learnt.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from testbed.compiled import njit
from testbed.estimation.live import unknowns
from testbed.estimation.live.fusion import Fusion, variance_of
from testbed.formats.arrays import Array
from testbed.formats.records import Record, quantity

if TYPE_CHECKING:
    from testbed.estimation.live.body_records import BodyBelief, BodyState


SHARE = 0.05
"""Least upward force, share of the weight: no machine is lighter than believed by so much (E)."""
OPENS, CLOSES = 5.0, 2.0
"""Standard deviations of the missing force beyond which something else carries, and below which it
no longer does (E).
"""
TURNS_S = 0.2
"""Time for which it must be beyond, or below: longer than a foot takes to touch down (E)."""


ALONG, ASIDE, UP, ABOUT_X, ABOUT_Y = (
    unknowns.WRENCH.index(name) for name in ("fx", "fy", "fz", "tx", "ty")
)
"""Places of these equations in WRENCH."""


class Support(Record):
    """What is concluded so far."""

    carries = quantity("1", "1 while something else carries, else 0")
    otherwise = quantity("s", "for how long the opposite of `carries` has seemed true")


@njit
def something_else_carries(
    rows: Array, wrench: Array, variance: float, belief: BodyBelief, state: BodyState
) -> bool:
    """Whether something else than feet, ropes and drill carries the body; counts for how long.

    rows (6, unknowns); wrench (6): residual of the balance before anything learnt is
    subtracted, N and N m; variance: of its force along z, N2.
    """
    fusion, support, least = state.fusion, state.support, SHARE * belief.weight
    lift = -left_over(fusion, rows[UP], wrench[UP])
    if support.carries == 0.0 and lift <= least:
        support.otherwise = 0.0
        return False
    sd = math.sqrt(variance_of(fusion, rows[UP], variance))
    if support.carries == 0.0:
        turns = lift > OPENS * sd and within_belly(fusion, rows, wrench, lift, belief)
    else:
        turns = lift <= CLOSES * sd
    support.otherwise = support.otherwise + belief.every * belief.decisions.dt if turns else 0.0
    if support.otherwise >= TURNS_S:
        support.carries, support.otherwise = 1.0 - support.carries, 0.0
    return support.carries != 0.0


@njit
def left_over(fusion: Fusion, row: Array, missing: float) -> float:
    """Residual of one equation after what is learnt; row (unknowns,)."""
    for index in range(unknowns.COUNT):
        missing -= row[index] * fusion.x[index]
    return missing


@njit
def within_belly(
    fusion: Fusion, rows: Array, wrench: Array, lift: float, belief: BodyBelief
) -> bool:
    """Whether a force that closes the balance, `lift` (N) of it along z, acts through the belly."""
    along = -left_over(fusion, rows[ALONG], wrench[ALONG])
    aside = -left_over(fusion, rows[ASIDE], wrench[ASIDE])
    about_x = -left_over(fusion, rows[ABOUT_X], wrench[ABOUT_X])
    about_y = -left_over(fusion, rows[ABOUT_Y], wrench[ABOUT_Y])
    height = belief.belly_height
    x, y = (height * along - about_y) / lift, (about_x + height * aside) / lift
    return abs(x) < belief.belly_length and abs(y) < belief.belly_width
