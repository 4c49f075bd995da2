"""Which pressure sensor reads wrong, if one does: a test of the body's balance for each vertical
cylinder. Compiled.

r (3) is the residual of the balance along the body's z and about its x and y, S (3, 3) its
covariance on a sound machine. If the sensors of vertical cylinder i add a force b, the residual is
d_i b. The likeliest b, and the rise of twice the log likelihood with it, are

    b_i = d_i' S^-1 r / (d_i' S^-1 d_i),   T_i = b_i d_i' S^-1 r

r and S are means over about a second of sliding: friction then changes its sign with the motion, a
sensor's error does not. (At rest the friction of all pistons may act the same way for long.) Where
the largest T exceeds what a sound machine shows, the zero of that cylinder is freed: its prior
becomes as wide as b, and it is learnt like any other unknown. If an undeclared weight on board
explains more (payload_aboard.py), that is freed instead. The filter then starts anew, since what it
had learnt explained the fault by something else.
"""

from __future__ import annotations

import numpy as np

from testbed.compiled import njit
from testbed.estimation.live import unknowns
from testbed.estimation.live.fusion import Fusion, is_freed, start
from testbed.estimation.live.payload_aboard import free_payload, likeliest_payload
from testbed.estimation.live.unknowns import VERTICAL_EQUATIONS
from testbed.formats.arrays import Array
from testbed.machine.names import AXES, VERTICAL

NOBODY = -1
PLACE_COSTS = 2.0
"""By so much the T of a weight must exceed a sensor's, since its place is chosen as well (E)."""


@njit
def take_balance(rows: Array, wrench: Array, variance: Array, reach: Array, fusion: Fusion) -> None:
    """Take one balance: rows (6, unknowns), wrench (6) that is missing with nothing learnt
    taken off, variance (6) of the balance itself; reach (2): half of the platform's length and
    width, m.
    """
    suspicion, sizes = fusion.suspicion, fusion.sizes
    if suspicion.threshold == 0.0:
        return
    spread = spread_of(rows, variance, fusion)
    first = suspicion.age == 0.0
    held = spread[0, 0] if first else suspicion.spread[0, 0]
    surer = min(held / spread[0, 0], 1.0)  # than now, when pistons turn round
    share = surer**2 * sizes.dt / suspicion.memory
    for place in range(len(VERTICAL_EQUATIONS)):
        missing = wrench[VERTICAL_EQUATIONS[place]]
        for cylinder in range(len(AXES)):
            if is_freed(fusion, cylinder):
                zero = unknowns.ZERO + cylinder
                missing -= rows[VERTICAL_EQUATIONS[place], zero] * fusion.x[zero]
        if first:
            suspicion.missing[place] = missing
        suspicion.missing[place] += share * (missing - suspicion.missing[place])
        for other in range(len(VERTICAL_EQUATIONS)):
            if first:
                suspicion.spread[place, other] = spread[place, other]
            news = spread[place, other] - suspicion.spread[place, other]
            suspicion.spread[place, other] += share * news
    suspicion.age += surer**2 * sizes.dt
    if suspicion.age > suspicion.memory:
        free_likeliest(rows, reach, fusion)


@njit
def spread_of(rows: Array, variance: Array, fusion: Fusion) -> Array:
    """S (3, 3): covariance of what a sound machine's balance would miss now, from what is known of
    every unknown beforehand and from the variance (6) of the balance itself.
    """
    suspicion, sizes = fusion.suspicion, fusion.sizes
    prior = np.empty(unknowns.COUNT)
    for unknown in range(unknowns.COUNT):
        prior[unknown] = suspicion.known[unknown] ** 2
    for cylinder in range(len(AXES)):
        prior[unknowns.ZERO + cylinder] = sizes.zero_sd[cylinder] ** 2
        prior[unknowns.DEVIATION + cylinder] = sizes.spread[cylinder] ** 2
    for component in range(len(sizes.balance_sd)):
        prior[unknowns.BALANCE + component] = sizes.balance_sd[component] ** 2
    spread = np.empty((len(VERTICAL_EQUATIONS), len(VERTICAL_EQUATIONS)))
    for place in range(len(VERTICAL_EQUATIONS)):
        for other in range(len(VERTICAL_EQUATIONS)):
            spread[place, other] = variance[VERTICAL_EQUATIONS[place]] if place == other else 0.0
            for unknown in range(unknowns.COUNT):
                both = (
                    rows[VERTICAL_EQUATIONS[place], unknown]
                    * rows[VERTICAL_EQUATIONS[other], unknown]
                )
                spread[place, other] += both * prior[unknown]
    return spread


@njit
def free_likeliest(rows: Array, reach: Array, fusion: Fusion) -> None:
    """Free what makes the balance far likelier, if anything does: the zero of one cylinder, or a
    weight on board.
    """
    suspicion = fusion.suspicion
    weights = inverse_of_three(suspicion.spread)
    best, likeliest, size = suspicion.threshold**2, NOBODY, 0.0
    for cylinder in VERTICAL:
        zero = unknowns.ZERO + cylinder
        push = pushed = 0.0  # d_i' S^-1 r and d_i' S^-1 d_i
        for place in range(len(VERTICAL_EQUATIONS)):
            for other in range(len(VERTICAL_EQUATIONS)):
                weighed = rows[VERTICAL_EQUATIONS[place], zero] * weights[place, other]
                push += weighed * suspicion.missing[other]
                pushed += weighed * rows[VERTICAL_EQUATIONS[other], zero]
        if is_freed(fusion, cylinder) or pushed == 0.0:
            continue
        force = push / pushed
        if push * force > best:
            best, likeliest, size = push * force, cylinder, abs(force)
    payload = likeliest_payload(rows, weights, suspicion.missing, reach)
    if fusion.suspicion.known[unknowns.MASS] > 0.0 and payload[0] > best + PLACE_COSTS:
        free_payload(payload, reach, fusion)
        suspicion.age = 0.0
    elif likeliest != NOBODY:
        fusion.blamed[likeliest] = size
        start(fusion, suspicion.known[: len(unknowns.CONSTANTS)])
        suspicion.age = 0.0


@njit
def inverse_of_three(matrix: Array) -> Array:
    """Inverse (3, 3) by cofactors: compiled in a tenth of the time that NumPy's solver takes."""
    inverse = np.empty((3, 3))
    for row in range(3):
        below, last = (row + 1) % 3, (row + 2) % 3
        for column in range(3):
            right, end = (column + 1) % 3, (column + 2) % 3
            inverse[column, row] = (
                matrix[below, right] * matrix[last, end] - matrix[below, end] * matrix[last, right]
            )
    determinant = 0.0
    for column in range(3):
        determinant += matrix[0, column] * inverse[column, 0]
    for row in range(3):
        for column in range(3):
            inverse[row, column] /= determinant
    return inverse
