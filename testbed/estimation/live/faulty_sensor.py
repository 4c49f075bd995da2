"""Which pressure sensor lies, if one does: the body's balance against each vertical cylinder alone.
Compiled.

What feet, weight, ropes and drill are missing along the body's z and about its x and y, r (3), is
held against all that a sound machine may be off by, S (3, 3). A vertical cylinder i whose sensors
add a force b would miss d_i b, so the likeliest b, and how much likelier the balance is with it:

    b_i = d_i' S^-1 r / (d_i' S^-1 d_i),   T_i = b_i d_i' S^-1 r

r and S are means over a second or so of sliding: friction then changes its sign with the motion, a
sensor does not; at rest all pistons may hide the same way for long. Where the best T exceeds what a
sound machine shows, that cylinder's zero is set free and learnt like any other unknown, so that it
carries the blame alone, unless a weight on board explains more (payload_aboard.py). What was learnt
before is forgotten, for others took the blame.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.estimation.live import fusion as fu
from testbed.estimation.live.payload_aboard import free_payload, likeliest_payload
from testbed.machine.names import AXES, VERTICAL

SEEN = (2, 3, 4)
"""Rows of the balance (force x, y, z, moment x, y, z) that vertical cylinders make up."""
NOBODY = -1
PLACE_COSTS = 2.0
"""So much more a weight must explain than a sensor, since its place is chosen as well (E)."""


@njit
def take_balance(rows: Any, wrench: Any, variance: Any, reach: Any, fusion: Any) -> None:
    """Take one balance: rows (6, N) of the unknowns, wrench (6) that is missing with nothing learnt
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
    for place in range(len(SEEN)):
        missing = wrench[SEEN[place]]
        for cylinder in range(len(AXES)):
            if fusion.blamed[cylinder] > 0.0:
                zero = fu.ZERO + cylinder
                missing -= rows[SEEN[place], zero] * fusion.x[zero]
        if first:
            suspicion.missing[place] = missing
        suspicion.missing[place] += share * (missing - suspicion.missing[place])
        for other in range(len(SEEN)):
            if first:
                suspicion.spread[place, other] = spread[place, other]
            news = spread[place, other] - suspicion.spread[place, other]
            suspicion.spread[place, other] += share * news
    suspicion.age += surer**2 * sizes.dt
    if suspicion.age > suspicion.memory:
        free_likeliest(rows, reach, fusion)


@njit
def spread_of(rows: Any, variance: Any, fusion: Any) -> Any:
    """S (3, 3): covariance of what a sound machine's balance would miss now, from what is known of
    every unknown beforehand and from the variance (6) of the balance itself.
    """
    suspicion, sizes = fusion.suspicion, fusion.sizes
    prior = np.empty(fu.N)
    for unknown in range(fu.N):
        prior[unknown] = suspicion.known[unknown] ** 2
    for cylinder in range(len(AXES)):
        prior[fu.ZERO + cylinder] = sizes.zero_sd[cylinder] ** 2
        prior[fu.DEVIATION + cylinder] = sizes.spread[cylinder] ** 2
    for component in range(len(sizes.balance_sd)):
        prior[fu.BALANCE + component] = sizes.balance_sd[component] ** 2
    spread = np.empty((len(SEEN), len(SEEN)))
    for place in range(len(SEEN)):
        for other in range(len(SEEN)):
            spread[place, other] = variance[SEEN[place]] if place == other else 0.0
            for unknown in range(fu.N):
                both = rows[SEEN[place], unknown] * rows[SEEN[other], unknown]
                spread[place, other] += both * prior[unknown]
    return spread


@njit
def free_likeliest(rows: Any, reach: Any, fusion: Any) -> None:
    """Set free what makes the balance far likelier: the zero of one cylinder, or a weight."""
    suspicion = fusion.suspicion
    weights = inverse_of_three(suspicion.spread)
    best, likeliest, size = suspicion.threshold**2, NOBODY, 0.0
    for cylinder in VERTICAL:
        zero = fu.ZERO + cylinder
        push = pushed = 0.0  # d_i' S^-1 r and d_i' S^-1 d_i
        for place in range(len(SEEN)):
            for other in range(len(SEEN)):
                weighed = rows[SEEN[place], zero] * weights[place, other]
                push += weighed * suspicion.missing[other]
                pushed += weighed * rows[SEEN[other], zero]
        if fusion.blamed[cylinder] > 0.0 or pushed == 0.0:
            continue
        force = push / pushed
        if push * force > best:
            best, likeliest, size = push * force, cylinder, abs(force)
    payload = likeliest_payload(rows, weights, suspicion.missing, reach)
    if fusion.suspicion.known[fu.MASS] > 0.0 and payload[0] > best + PLACE_COSTS:
        free_payload(payload, reach, fusion)
        suspicion.age = 0.0
    elif likeliest != NOBODY:
        fusion.blamed[likeliest] = size
        fu.start(fusion, suspicion.known[: len(fu.CONSTANTS)])
        suspicion.age = 0.0


@njit
def inverse_of_three(matrix: Any) -> Any:
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
