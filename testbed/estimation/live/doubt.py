"""How far the balance of the body is doubted: can the friction that it implies be true? Compiled.

The balance compares what the cylinders measure with weight, ropes and drill as believed. The filter
divides the difference between the friction of the vertical pistons and an error of the balance
itself, each according to its variance. On a machine that is as believed, both parts are about as
large as their standard deviations, and their cost

    d' R^-1 d + b' b

    d (4)     deviation of each vertical piston's friction, over its standard deviation
    R (4, 4)  correlation of the four
    b (3)     error of the balance along z, about x and about y, over its standard deviation

is about the number of equations. With an undeclared tonne on board it is many times that: the
friction of all pistons would have to be at its limit in the same direction. Then the balance is
wrong, not friction. Its standard deviation is multiplied by the doubt, which grows until the cost
is believable; the loads then follow the pressures alone, with intervals as wide as friction leaves
them.

The larger the doubt, the smaller the cost that is accepted. So a balance that is slightly off is
kept, and one that is wrong is given up altogether: half believed, it would still pull the loads its
way. The doubt decays once the balance fits again.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from testbed.compiled import njit
from testbed.estimation.live import unknowns
from testbed.estimation.live.axis import AxisState
from testbed.estimation.live.fusion import Fusion, Sizes
from testbed.estimation.live.unknowns import VERTICAL_EQUATIONS
from testbed.formats.records import Records
from testbed.machine.names import LEGS, VERTICAL

if TYPE_CHECKING:
    from testbed.estimation.live.body_records import BodyBelief


NONE = 1.0
"""Doubt of a balance that is believed."""
MOST = 100.0
"""Largest doubt (E)."""
FASTEST = 3.0
"""Within `doubt_time` the doubt grows or fades at most by e to this power (E)."""
SLID = 2.0
"""Factor of the believable cost once a vertical piston has slid: seals, encoders and pressures
follow a motion with different delays, and leaking oil moves the friction with which pistons stopped
the same way at all of them. On sound drawn machines that have walked the cost is up to 16 (E).
"""
LEAST_COST = 1.0e-6
"""A smaller cost counts as this one, as its logarithm is taken."""


@njit
def widen_balance(sizes: Sizes, doubt: float) -> None:
    """Fill `doubted_sd` of fusion's Sizes: the balance's standard deviations as believed, times
    the doubt.
    """
    for equation in range(len(sizes.balance_sd)):
        sizes.doubted_sd[equation] = sizes.balance_sd[equation]
    for equation in VERTICAL_EQUATIONS:
        sizes.doubted_sd[equation] *= doubt


@njit
def cost_of_balance(fusion: Fusion) -> float:
    """Sum of the squares of friction's deviations and of the balance's errors, each over its
    standard deviation, as the filter has them now; correlated deviations count less.
    """
    x, sizes = fusion.x, fusion.sizes
    squares = total = alike = 0.0
    for leg in range(len(LEGS)):
        piston = VERTICAL[leg]
        deviation = x[unknowns.DEVIATION + piston] / sizes.spread[piston]
        squares += deviation**2
        total += deviation
        alike += sizes.alike[leg] / len(LEGS)
    common = alike / (1.0 + (len(LEGS) - 1) * alike)
    cost = (squares - common * total**2) / (1.0 - alike)
    for equation in VERTICAL_EQUATIONS:
        cost += (x[unknowns.BALANCE + equation] / sizes.doubted_sd[equation]) ** 2
    return cost


@njit
def reported_share(share: float, doubt: float) -> float:
    """Share of the filter's standard deviation that is reported: `share` where the balance is
    believed, all of it where it is not.
    """
    return 1.0 - (1.0 - share) / doubt


@njit
def believable_cost(axes: Records[AxisState], belief: BodyBelief) -> float:
    """Cost up to which a balance is believed: `doubt_cost` while no vertical piston has slid since
    the start, SLID times that otherwise.
    """
    slid = 0.0
    for piston in VERTICAL:
        slid = max(slid, axes[piston].has_slid)
    return belief.doubt_cost * (SLID if slid > 0.0 else 1.0)


@njit
def followed(doubt: float, cost: float, believable: float, belief: BodyBelief) -> float:
    """The doubt after one balance at this cost: it grows while the cost exceeds the believable one
    over the doubt, and fades while it is less.
    """
    if belief.doubt_cost <= 0.0 or not math.isfinite(cost):
        return NONE
    rate = math.log(max(cost, LEAST_COST) * doubt / believable)
    rate = min(max(rate, -FASTEST), FASTEST)
    passed = belief.every * belief.decisions.dt / belief.doubt_time
    return min(max(doubt * math.exp(rate * passed), NONE), MOST)
