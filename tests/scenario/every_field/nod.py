"""Two gaits for a task of kind program: one that holds still, one that lowers the body."""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.control.gait import Command

SPEED_M_S = 0.02


class Hold:
    """Stays where it began."""

    def __init__(self, start: Any) -> None:
        self.joints = start.joints

    def command(self, t: float, dt: float, measured: Any) -> Command:
        """The start's joints at any time."""
        return Command(joints=self.joints)


class Nod(Hold):
    """Retracts the vertical cylinders."""

    def command(self, t: float, dt: float, measured: Any) -> Command:
        """The vertical set points at time t, lower by what has passed."""
        lower = np.tile([0.0, 0.0, SPEED_M_S * t], 4)
        return Command(joints=self.joints - lower)
