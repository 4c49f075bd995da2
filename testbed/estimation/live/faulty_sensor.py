"""Which pressure sensor lies, if one does: the body's balance against each vertical cylinder alone.
Compiled.

What feet, weight, ropes and drill are missing along the body's z and about its x and y, r (3), is
held against all that a sound machine may be off by, S (3, 3). A vertical cylinder i whose sensors
add a force b would miss d_i b, so the likeliest b, and how much likelier the balance is with it:

    b_i = d_i' S^-1 r / (d_i' S^-1 d_i),   T_i = b_i d_i' S^-1 r

r and S are means over a second or so of sliding: friction then changes its sign with the motion, a
sensor does not; at rest all pistons may hide the same way for long. Where the best T exceeds what a
sound machine shows, that cylinder's zero is set free and learnt like any other unknown, so that it
carries the blame alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.estimation.live import fusion as fu

SEEN = (2, 3, 4)
"""Rows of the balance that vertical cylinders make up."""


@njit
def take_balance(rows: Any, wrench: Any, variance: Any, fusion: Any) -> None:
    """Take one balance: rows (6, N) of the unknowns, wrench (6) that is missing with nothing learnt
    taken off, variance (6) of the balance itself.
    """
    suspicion, sizes = fusion.suspicion, fusion.sizes
    if suspicion.threshold == 0.0:
        return
    prior = np.empty(fu.N)
    for j in range(fu.N):
        prior[j] = suspicion.known[j] ** 2
    for i in range(12):
        prior[fu.ZERO + i] = sizes.zero_sd[i] ** 2
        prior[fu.DEVIATION + i] = sizes.spread[i] ** 2
    for k in range(6):
        prior[fu.BALANCE + k] = sizes.balance_sd[k] ** 2
    spread = np.empty((3, 3))
    for a in range(3):
        for b in range(3):
            spread[a, b] = variance[SEEN[a]] if a == b else 0.0
            for j in range(fu.N):
                spread[a, b] += rows[SEEN[a], j] * rows[SEEN[b], j] * prior[j]
    first = suspicion.age == 0.0
    held = spread[0, 0] if first else suspicion.spread[0, 0]
    surer = min(held / spread[0, 0], 1.0)  # than now, when pistons turn round
    share = surer**2 * sizes.dt / suspicion.memory
    for a in range(3):
        missing = wrench[SEEN[a]]
        for i in range(12):
            if fusion.blamed[i] > 0.0:
                missing -= rows[SEEN[a], fu.ZERO + i] * fusion.x[fu.ZERO + i]
        if first:
            suspicion.missing[a] = missing
        suspicion.missing[a] += share * (missing - suspicion.missing[a])
        for b in range(3):
            if first:
                suspicion.spread[a, b] = spread[a, b]
            suspicion.spread[a, b] += share * (spread[a, b] - suspicion.spread[a, b])
    suspicion.age += surer**2 * sizes.dt
    if suspicion.age > suspicion.memory:
        free_likeliest_zero(rows, fusion)


@njit
def free_likeliest_zero(rows: Any, fusion: Any) -> None:
    """Set the zero of the one cylinder free that makes the balance far likelier."""
    suspicion = fusion.suspicion
    weights = inverse_of_three(suspicion.spread)
    best, who, size = suspicion.threshold**2, -1, 0.0
    for i in range(2, 12, 3):
        push = pushed = 0.0  # d_i' S^-1 r and d_i' S^-1 d_i
        for a in range(3):
            for b in range(3):
                weighed = rows[SEEN[a], fu.ZERO + i] * weights[a, b]
                push += weighed * suspicion.missing[b]
                pushed += weighed * rows[SEEN[b], fu.ZERO + i]
        if fusion.blamed[i] > 0.0 or pushed == 0.0:
            continue
        force = push / pushed
        if push * force > best:
            best, who, size = push * force, i, abs(force)
    if who >= 0:
        fusion.blamed[who] = size
        fusion.p[fu.ZERO + who, fu.ZERO + who] += size**2
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
