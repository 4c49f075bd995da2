"""Sharing for drilling: keep every foot loaded against the thrust that is and the thrust that may
come.

The program of quadratic.py with what a surge of the thrust takes off each foot: with SURGE_N more
of it the friction used is still the least. What the thrust takes off a foot follows from four
equally stiff legs, d n / d thrust = -N^+ wrench. The drill's true reaction is not the ordered one
(blows, rods, a wrong payload): the sum of the estimated loads says how much is missing, and a slow
observer adds that to the thrust.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from testbed.control.distribution.distribution import Plan
from testbed.control.distribution.quadratic import Quadratic
from testbed.control.distribution.statics import NORMALS, ROPES, Balance
from testbed.formats.arrays import Array

SURGE_N = 1500.0
"""Thrust that may come on top without warning: the peak of a blow's reaction (E)."""
OBSERVER_SHARE = 0.01
"""Part of the missing load that the observer takes over at each plan: 1 s at 100 Hz (E)."""
OBSERVER_LIMIT_N = 4000.0
"""No larger missing thrust is believed (E)."""


class DrillSharing(Quadratic):
    """See the module's docstring."""

    def __init__(self, friction: float | None = None) -> None:
        super().__init__(friction)
        self.disturbance_n = 0.0
        """Thrust beyond the ordered one that the loads tell of, N, + away from the slope."""

    def plan(self, now: Balance) -> Plan:
        """See Controller."""
        self._observe(now)
        load = now.load + self.disturbance_n * now.thrust_map
        return replace(super().plan(replace(now, load=load)), load=load)

    def taken(self, now: Balance) -> Array:
        """(4,) what a surge takes off each foot, N."""
        return taken_by_thrust(now) * now.scale.force * SURGE_N

    def _observe(self, now: Balance) -> None:
        """The feet's normal loads must balance the rest along z; what lacks is a thrust nobody
        ordered.
        """
        if not now.stance.all():
            return
        pull = now.balance[2, ROPES] @ now.measured_pull_n
        missing = -(now.load[2] + pull) - float(now.measured_loads_n.sum())
        moved = self.disturbance_n + OBSERVER_SHARE * (missing - self.disturbance_n)
        most = now.scale.force * OBSERVER_LIMIT_N
        self.disturbance_n = float(np.clip(moved, -most, most))


def taken_by_thrust(now: Balance) -> Array:
    """(4,) change of the normal loads by a unit thrust, four equally stiff legs in stance."""
    normal = now.balance[2:5, NORMALS] * now.stance
    return np.asarray(-normal.T @ np.linalg.lstsq(normal @ normal.T, now.thrust_map[2:5])[0])
