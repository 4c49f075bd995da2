"""The program of quadratic.py as the numbers that daqp takes, filled in place by compiled code: one is solved a tick.

Unknowns (15): the plan's (14) in units of the load, then s, the highest use of friction. Rows: one a side of each
stance foot's cone, the joints (12), the balance (6).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import daqp
import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.control.distribution.statics import FEET, UNKNOWNS, Balance
from testbed.machine.names import AXES, LEGS

Array = NDArray[np.float64]
SIZE = UNKNOWNS + 1
USE = UNKNOWNS
"""Index of s."""
JOINTS, WRENCH = len(AXES), 6
EQUALITY = 5
"""daqp's word for a row that must hold exactly."""
FREE = 1e30
"""daqp's infinity."""


class About(NamedTuple):
    """What a program is made about and bounded by; forces in units of the load."""

    scale: float
    """The load, N."""
    lowest: float
    """Least normal force of a stance foot."""
    highest_pull: float
    doubt: float
    """What joints at rest hide of a tangential force."""
    use: float
    """The s about which s * n is taken."""
    least_use: float
    """s falls no further."""
    tangential: float
    even: float
    steady: float
    worst: float
    """Weights: tangential forces, normal loads, change of the pulls, s."""


class UseProgram:
    """The program's arrays, and its solution. `sides` (4 * n, 14): rows of |t| of each foot, as z's linear parts."""

    def __init__(self, sides: Array) -> None:
        most = len(sides) + JOINTS + WRENCH
        self._sides = sides
        self._hessian, self._costs = np.zeros((SIZE, SIZE)), np.zeros(SIZE)
        self._rows = np.zeros((most, SIZE))
        self._lower, self._upper = np.zeros(SIZE + most), np.zeros(SIZE + most)
        self._kind = np.zeros(SIZE + most, dtype=np.intc)

    def solve(
        self, now: Balance, normals: Array, pull: Array, taken: Array, about: About
    ) -> Array | None:
        """The best (15,), or None if there is none; normals (4), pull (2) of the last plan, taken (4) of the surge."""
        count = write_program(
            now.balance,
            now.load,
            now.joint_map,
            now.held,
            now.lowest,
            now.highest,
            now.stance,
            normals,
            pull,
            taken,
            *about,
            self._sides,
            self._hessian,
            self._costs,
            self._rows,
            self._lower,
            self._upper,
            self._kind,
        )
        bounds = SIZE + count
        found, _, ended, _ = daqp.solve(
            self._hessian,
            self._costs,
            self._rows[:count],
            self._upper[:bounds],
            self._lower[:bounds],
            self._kind[:bounds],
        )
        return np.asarray(found) if ended > 0 else None


@njit
def write_program(
    balance: Any,
    load: Any,
    joint_map: Any,
    held: Any,
    lowest_joint: Any,
    highest_joint: Any,
    stance: Any,
    normals: Any,
    pull: Any,
    taken: Any,
    scale: float,
    lowest: float,
    highest_pull: float,
    doubt: float,
    use: float,
    least_use: float,
    tangential: float,
    even: float,
    steady: float,
    worst: float,
    sides: Any,
    hessian: Any,
    costs: Any,
    rows: Any,
    lower: Any,
    upper: Any,
    kind: Any,
) -> int:
    """Fill the arrays of a UseProgram; returns how many rows there are."""
    for i in range(SIZE):
        weight = worst if i == USE else steady if i >= FEET else even if i % 3 == 0 else tangential
        hessian[i, i] = weight
        costs[i] = -steady * pull[i - FEET] if FEET <= i < UNKNOWNS else 0.0
        lower[i], upper[i] = -FREE, FREE
    for i in range(FEET, UNKNOWNS):
        lower[i], upper[i] = 0.0, highest_pull
    lower[USE] = least_use
    count, each = 0, sides.shape[0] // len(LEGS)
    for leg in range(len(LEGS)):
        if not stance[leg]:
            for i in range(3 * leg, 3 * leg + 3):
                lower[i] = upper[i] = 0.0
            continue
        lower[3 * leg] = lowest
        about = max(normals[leg] + taken[leg], 0.02)
        for side in range(leg * each, (leg + 1) * each):
            for i in range(UNKNOWNS):
                rows[count, i] = sides[side, i]
            rows[count, 3 * leg], rows[count, USE] = -use, -about
            lower[SIZE + count], upper[SIZE + count] = -FREE, -doubt + use * (taken[leg] - about)
            count += 1
    for joint in range(JOINTS):
        for i in range(UNKNOWNS):
            rows[count, i] = joint_map[joint, i]
        rows[count, USE] = 0.0
        lower[SIZE + count] = (lowest_joint[joint] - held[joint]) / scale
        upper[SIZE + count] = (highest_joint[joint] - held[joint]) / scale
        count += 1
    for k in range(SIZE + count):
        kind[k] = 0
    for part in range(WRENCH):
        for i in range(UNKNOWNS):
            rows[count, i] = balance[part, i]
        rows[count, USE] = 0.0
        lower[SIZE + count] = upper[SIZE + count] = -load[part] / scale
        kind[SIZE + count] = EQUALITY
        count += 1
    return count


@njit
def highest_use(z: Any, sides: Any) -> float:
    """Highest use of friction of a plan (14 and more), as the pyramids of `sides` measure it."""
    highest, each = 0.0, sides.shape[0] // len(LEGS)
    for leg in range(len(LEGS)):
        for side in range(leg * each, (leg + 1) * each):
            across = (
                sides[side, 3 * leg + 1] * z[3 * leg + 1]
                + sides[side, 3 * leg + 2] * z[3 * leg + 2]
            )
            highest = max(highest, across / max(z[3 * leg], 1e-3))
    return highest
