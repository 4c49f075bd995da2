"""The program of quadratic.py as the numbers that daqp takes, filled in place by compiled code: one
is solved a tick.

Unknowns (15): the plan's (14) in units of the load, then s, the highest use of friction. Rows: one
a side of each stance foot's cone, the joints (12), the balance (6).
"""

from __future__ import annotations

from typing import NamedTuple

import daqp
import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.control.distribution.statics import FEET, UNKNOWNS, Balance
from testbed.formats.arrays import Array, Flags
from testbed.machine.names import AXES, LEGS

SIZE = UNKNOWNS + 1
"""Unknowns of the program."""
USE = UNKNOWNS
"""Index of s."""
JOINTS = len(AXES)
"""Rows of the joints' limits."""
WRENCH = 6
"""Rows of the balance."""
EQUALITY = 5
"""daqp's mark of a row that must hold exactly."""
FREE = 1e30
"""daqp's infinity."""
LEAST_NORMAL = 0.02
"""The program is made about no smaller normal force of a foot, in units of the load."""


class ProgramScale(NamedTuple):
    """What a program is made about and bounded by; forces in units of the load."""

    scale: float
    """The load, N."""
    lowest: float
    """Least normal force of a stance foot."""
    highest_pull: float
    """Rating of the ropes' traction devices."""
    doubt: float
    """What joints at rest hide of a tangential force."""
    use: float
    """The s about which s * n is taken."""
    least_use: float
    """s falls no further."""
    tangential: float
    """Weight of the tangential forces."""
    even: float
    """Weight of the normal loads."""
    steady: float
    """Weight of a change of the pulls."""
    worst: float
    """Weight of s."""


class Facts(NamedTuple):
    """What a program holds to: see Balance."""

    balance: Array
    load: Array
    joint_map: Array
    held: Array
    lowest: Array
    highest: Array
    stance: Flags


class LastPlan(NamedTuple):
    """What a program begins from, in units of the load."""

    normals: Array
    """(4,) normal forces of the last plan."""
    pull: Array
    """(2,) its rope pulls."""
    taken: Array
    """(4,) what a surge of the thrust would take off each foot."""


class Arrays(NamedTuple):
    """What daqp takes, with room for as many rows as there can be."""

    hessian: Array
    costs: Array
    rows: Array
    lower: Array
    upper: Array
    kind: NDArray[np.intc]

    @classmethod
    def of(cls, rows: int) -> Arrays:
        """Zeros for so many rows."""
        bounds = SIZE + rows
        return cls(
            np.zeros((SIZE, SIZE)),
            np.zeros(SIZE),
            np.zeros((rows, SIZE)),
            np.zeros(bounds),
            np.zeros(bounds),
            np.zeros(bounds, dtype=np.intc),
        )


class UseProgram:
    """The program's arrays, and its solution. `sides` (4 * n, 14): rows of |t| of each foot, as z's
    linear parts.
    """

    def __init__(self, sides: Array) -> None:
        self._sides = sides
        self._arrays = Arrays.of(len(sides) + JOINTS + WRENCH)

    def solve(self, now: Balance, last: LastPlan, about: ProgramScale) -> Array | None:
        """The best (15,), or None if there is none."""
        facts = Facts(
            now.balance, now.load, now.joint_map, now.held, now.lowest, now.highest, now.stance
        )
        out = self._arrays
        count = write_program(facts, last, about, self._sides, out)
        bounds = SIZE + count
        found, _, ended, _ = daqp.solve(
            out.hessian,
            out.costs,
            out.rows[:count],
            out.upper[:bounds],
            out.lower[:bounds],
            out.kind[:bounds],
        )
        return np.asarray(found) if ended > 0 else None


@njit
def write_program(
    facts: Facts, last: LastPlan, about: ProgramScale, sides: Array, out: Arrays
) -> int:
    """Fill the Arrays `out` of a UseProgram; returns how many rows there are."""
    _write_costs(last, about, out)
    count: int = _write_feet(facts, last, about, sides, out)
    lower, upper = out.lower, out.upper
    for joint in range(JOINTS):
        for index in range(UNKNOWNS):
            out.rows[count, index] = facts.joint_map[joint, index]
        out.rows[count, USE] = 0.0
        lower[SIZE + count] = (facts.lowest[joint] - facts.held[joint]) / about.scale
        upper[SIZE + count] = (facts.highest[joint] - facts.held[joint]) / about.scale
        count += 1
    for k in range(SIZE + count):
        out.kind[k] = 0
    for part in range(WRENCH):
        for index in range(UNKNOWNS):
            out.rows[count, index] = facts.balance[part, index]
        out.rows[count, USE] = 0.0
        lower[SIZE + count] = upper[SIZE + count] = -facts.load[part] / about.scale
        out.kind[SIZE + count] = EQUALITY
        count += 1
    return count


@njit
def _write_costs(last: LastPlan, about: ProgramScale, out: Arrays) -> None:
    """Weights of the unknowns, and bounds of the pulls and of s."""
    for index in range(SIZE):
        if index == USE:
            weight = about.worst
        elif index >= FEET:
            weight = about.steady
        else:
            weight = about.even if index % 3 == 0 else about.tangential
        out.hessian[index, index] = weight
        out.costs[index] = (
            -about.steady * last.pull[index - FEET] if FEET <= index < UNKNOWNS else 0.0
        )
        out.lower[index], out.upper[index] = -FREE, FREE
    for index in range(FEET, UNKNOWNS):
        out.lower[index], out.upper[index] = 0.0, about.highest_pull
    out.lower[USE] = about.least_use


@njit
def _write_feet(
    facts: Facts, last: LastPlan, about: ProgramScale, sides: Array, out: Arrays
) -> int:
    """Bounds of the feet and a row for each side of the stance feet's cones; returns how many
    rows.
    """
    count, each = 0, sides.shape[0] // len(LEGS)
    lower, upper = out.lower, out.upper
    for leg in range(len(LEGS)):
        if not facts.stance[leg]:
            for index in range(3 * leg, 3 * leg + 3):
                lower[index] = upper[index] = 0.0
            continue
        lower[3 * leg] = about.lowest
        carried = max(last.normals[leg] + last.taken[leg], LEAST_NORMAL)
        for side in range(leg * each, (leg + 1) * each):
            for index in range(UNKNOWNS):
                out.rows[count, index] = sides[side, index]
            out.rows[count, 3 * leg], out.rows[count, USE] = -about.use, -carried
            lower[SIZE + count] = -FREE
            upper[SIZE + count] = -about.doubt + about.use * (last.taken[leg] - carried)
            count += 1
    return count


@njit
def highest_use(z: Array, sides: Array) -> float:
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
