"""Sharing for drilling: keep every foot loaded against the thrust that is and the thrust that may come.

The program of quadratic.py with one more unknown, the reserve r: the lowest normal load that is left when the drill
pushes `surge_n` more than now. Its weight makes the twist and the ropes serve the weakest foot first:

    min  friction use + steady ropes - keep * r
    with n_i + d n_i / d thrust * surge >= r for carrying feet, and everything quadratic.py keeps to

What the thrust takes off a foot follows from four equally stiff legs, d n / d thrust = -N^+ wrench. The drill's true
reaction is not the ordered one (blows, rods, a wrong payload): the sum of the estimated loads says how much is missing,
and a slow observer adds that to the thrust.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from testbed.control.distribution import Plan
from testbed.control.quadratic import Constraints, Quadratic, minimise
from testbed.control.statics import FEET, NORMALS, ROPES, UNKNOWNS, Balance

Array = NDArray[np.float64]
SURGE_N = 1500.0
"""Thrust that may come on top without warning: the peak of a blow's reaction (E)."""
KEEP = 1.0
"""Weight of the reserve, forces in units of the load (E)."""
OBSERVER_SHARE = 0.01
"""Part of the missing load that the observer takes over at each plan: 1 s at 100 Hz (E)."""
OBSERVER_LIMIT_N = 4000.0


class DrillSharing(Quadratic):
    """See the module's docstring."""

    name = "drill"

    def __init__(self, friction: float | None = None, surge_n: float = SURGE_N) -> None:
        super().__init__(friction, lowest_n=0.0)
        self.surge_n = surge_n
        self.disturbance_n = 0.0
        """Thrust beyond the ordered one that the loads tell of, N, + away from the slope."""

    def plan(self, now: Balance) -> Plan:
        """See Sharing."""
        self._observe(now)
        load = now.load + self.disturbance_n * now.thrust_map
        return replace(super().plan(replace(now, load=load)), load=load)

    def _observe(self, now: Balance) -> None:
        """The feet's normal loads must balance the rest along z; what lacks is a thrust nobody ordered."""
        if not now.carrying.all():
            return
        pull = now.balance[2, ROPES] @ now.measured_pull_n
        missing = -(now.load[2] + pull) - float(now.measured_loads_n.sum())
        moved = self.disturbance_n + OBSERVER_SHARE * (missing - self.disturbance_n)
        self.disturbance_n = float(np.clip(moved, -OBSERVER_LIMIT_N, OBSERVER_LIMIT_N))

    def _solve(self, now: Balance, lowest_n: float) -> Array | None:
        c = self.constraints(now, lowest_n)
        normals = np.full(4, c.scale / 6) if self._normals is None else self._normals
        pull = now.measured_pull_n if self._pull is None else self._pull
        weights, costs = np.full(UNKNOWNS + 1, 1e-6), np.zeros(UNKNOWNS + 1)
        use = (c.scale / np.maximum(normals, 0.02 * c.scale)) ** 2
        weights[1:FEET:3] = weights[2:FEET:3] = use
        weights[NORMALS], weights[ROPES] = 1e-3, 0.02
        costs[ROPES] = -0.02 * pull / c.scale
        costs[UNKNOWNS] = -KEEP
        z = minimise(weights, costs, _with_reserve(c, now, self.surge_n / c.scale))
        return None if z is None else z[:UNKNOWNS] * c.scale


def taken_by_thrust(now: Balance) -> Array:
    """(4,) change of the normal loads by a unit thrust, four equally stiff carrying legs."""
    normal = now.balance[2:5, NORMALS] * now.carrying
    return np.asarray(-np.linalg.pinv(normal) @ now.thrust_map[2:5])


def _with_reserve(c: Constraints, now: Balance, surge: float) -> Constraints:
    reserve = np.zeros((4, UNKNOWNS + 1))
    reserve[np.arange(4), np.arange(0, FEET, 3)] = -1.0
    reserve[:, UNKNOWNS] = 1.0
    reserve = reserve[now.carrying]
    after = taken_by_thrust(now)[now.carrying] * surge
    rows = np.vstack([np.hstack([c.rows, np.zeros((len(c.rows), 1))]), reserve])
    return replace(
        c,
        rows=rows,
        low=np.concatenate([c.low, np.full(len(reserve), -np.inf)]),
        high=np.concatenate([c.high, after]),
        balance=np.hstack([c.balance, np.zeros((6, 1))]),
        below=np.append(c.below, -1.0),
        above=np.append(c.above, 1.0),
    )
