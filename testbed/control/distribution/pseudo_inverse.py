"""Pseudo-inverse sharing: the smallest foot forces that balance the load, ropes kept at the pull
they had at the start.

f = -G^T (G G^T)^-1 (load + ropes), G (6, 12). Knows neither friction nor that feet cannot pull.
"""

from __future__ import annotations

import numpy as np

from testbed.control.distribution.distribution import Plan
from testbed.control.distribution.statics import FEET, ROPES, Balance
from testbed.formats.arrays import Array


class PseudoInverse:
    """See the module's docstring."""

    def __init__(self) -> None:
        self._pull: Array | None = None

    def plan(self, now: Balance) -> Plan:
        """See Controller."""
        if self._pull is None:
            self._pull = now.measured_pull_n.copy()
        feet = now.balance[:, :FEET][:, np.repeat(now.stance, 3)]
        wrench = now.load + now.balance[:, ROPES] @ self._pull
        forces = np.zeros(FEET)
        forces[np.repeat(now.stance, 3)] = -feet.T @ np.linalg.solve(feet @ feet.T, wrench)
        return Plan(np.concatenate([forces, self._pull]))
