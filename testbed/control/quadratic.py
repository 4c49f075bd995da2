"""Sharing by a quadratic program: least use of friction, feet that never pull, joints, supply and ropes within limits.

    min  sum_i (tx_i^2 + ty_i^2) / n_i^2 + even * sum_i n_i^2 + steady * |pull - last pull|^2
    with balance, n_i >= lowest, (tx, ty) inside the friction cone, joint forces within what the supply gives,
    0 <= pull <= rating

Forces in units of the load. 1 / n_i^2 is that of the last solution, so that equal use of friction is where it rests.
Solved by daqp through qpsolvers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.control.distribution import Plan
from testbed.control.statics import FEET, NORMALS, ROPES, UNKNOWNS, Balance
from testbed.parameters.names import LEGS
from testbed.parameters.provenance import roboclimber

Array = NDArray[np.float64]
CONE_SIDES = 8
LOWEST_NORMAL_N = 300.0
EVEN, STEADY = 0.3, 0.02
"""Weights of even normal loads and of quiet ropes against friction use squared (E)."""


@dataclass(frozen=True)
class Constraints:
    """low <= rows @ z <= high and below <= z <= above, balance @ z = value; z in units of `scale` N."""

    rows: Array
    low: Array
    high: Array
    balance: Array
    value: Array
    below: Array
    above: Array
    scale: float


class Quadratic:
    """See the module's docstring. `friction`: believed coefficient; None is the parameter file's."""

    name = "qp"

    def __init__(self, friction: float | None = None, lowest_n: float = LOWEST_NORMAL_N) -> None:
        numbers = roboclimber()
        self.friction = float(numbers["ground"]["friction"] if friction is None else friction)
        self.lowest_n = lowest_n
        self._rating_n = float(numbers["traction"]["rating_n"])
        self._traction_m2 = float(numbers["traction"]["piston_area_m2"])
        self._normals: Array | None = None
        self._pull: Array | None = None
        self._cones = _cones(self.friction)

    def plan(self, now: Balance) -> Plan:
        """See Sharing. A lowest normal load that cannot be had is given up first; then nothing is asked for."""
        z = self._solve(now, self.lowest_n)
        if z is None and self.lowest_n > 0.0:
            z = self._solve(now, 0.0)
        if z is None:
            return Plan(now.measured, feasible=False)
        self._normals, self._pull = np.maximum(z[NORMALS], 1.0), z[ROPES].copy()
        return Plan(z)

    def constraints(self, now: Balance, lowest_n: float) -> Constraints:
        """What a plan must keep to, with at least `lowest_n` on every carrying foot."""
        scale = float(np.linalg.norm(now.load[:3]))
        below, above = np.full(UNKNOWNS, -np.inf), np.full(UNKNOWNS, np.inf)
        below[NORMALS] = np.where(now.carrying, lowest_n / scale, 0.0)
        for leg in np.flatnonzero(~now.carrying):
            below[3 * leg : 3 * leg + 3], above[3 * leg : 3 * leg + 3] = 0.0, 0.0
        below[ROPES], above[ROPES] = 0.0, self._rating_n / scale
        rows = np.vstack([self._cones, now.joint_map])
        free = np.full(len(self._cones), -np.inf)
        return Constraints(
            rows=rows,
            low=np.concatenate([free, (now.lowest - now.held) / scale]),
            high=np.concatenate([np.zeros(len(self._cones)), (now.highest - now.held) / scale]),
            balance=now.balance,
            value=-now.load / scale,
            below=below,
            above=above,
            scale=scale,
        )

    def _solve(self, now: Balance, lowest_n: float) -> Array | None:
        c = self.constraints(now, lowest_n)
        normals = np.full(len(LEGS), c.scale / 6) if self._normals is None else self._normals
        pull = now.measured_pull_n if self._pull is None else self._pull
        weights, costs = np.zeros(UNKNOWNS), np.zeros(UNKNOWNS)
        use = (c.scale / np.maximum(normals, 0.02 * c.scale)) ** 2
        weights[1:FEET:3] = weights[2:FEET:3] = use
        weights[NORMALS] = EVEN
        weights[ROPES] = STEADY
        costs[ROPES] = -STEADY * pull / c.scale
        z = minimise(weights, costs, c)
        return None if z is None else z * c.scale


def minimise(weights: Array, costs: Array, c: Constraints) -> Array | None:
    """argmin z.diag(weights).z / 2 + costs.z under constraints, or None if there is no such z."""
    from qpsolvers import Problem
    from qpsolvers.solvers.daqp_ import daqp_solve_problem

    bounded = np.isfinite(c.low)
    rows = np.vstack([c.rows, -c.rows[bounded]])
    high = np.concatenate([c.high, -c.low[bounded]])
    problem = Problem(np.diag(weights), costs, rows, high, c.balance, c.value, c.below, c.above)
    found: Any = daqp_solve_problem(problem)
    return np.asarray(found.x) if found.found else None


def _cones(friction: float) -> Array:
    """Rows r with r . z <= 0: pyramids inside the friction cones."""
    inside = friction * np.cos(np.pi / CONE_SIDES)
    rows = np.zeros((len(LEGS) * CONE_SIDES, UNKNOWNS))
    for leg in range(len(LEGS)):
        for side in range(CONE_SIDES):
            angle = 2 * np.pi * side / CONE_SIDES
            rows[leg * CONE_SIDES + side, 3 * leg : 3 * leg + 3] = (-inside, np.cos(angle), np.sin(angle))
    return rows
