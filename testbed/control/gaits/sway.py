"""Set points of a body that moves to and fro over standing feet: sinusoids along its three axes.

All feet stay where they are, so every cylinder moves in both directions under load: what a residual
needs to show friction, leakage and drift apart. The ropes are hauled and paid out with the body.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.control.command import Command
from testbed.control.gait import BelievedStart
from testbed.control.measured import Measured
from testbed.scenario.tasks import Sway

Array = NDArray[np.float64]
RISE_S = 3.0
"""The amplitudes grow from nothing within this time (E)."""


class SwayGait:
    """See the module's docstring. A Gait."""

    def __init__(self, task: Sway, start: BelievedStart) -> None:
        self.task = task
        self._legs = start.legs
        self._feet = self._legs.feet(start.joints)
        self._nought = start.joints - self._legs.joints(self._feet)
        self._ropes = start.rope_directions_in_body

    def body_m(self, t: float) -> Array:
        """Where the body is meant to be at time t, from where it started (3), m, body axes."""
        since = t - self.task.start_s
        if since <= 0.0:
            return np.zeros(3)
        rise = 0.5 - 0.5 * np.cos(np.pi * min(since / RISE_S, 1.0))
        angle = 2.0 * np.pi * since / np.array(self.task.period_s)
        return np.asarray(rise * np.array(self.task.amplitude_m) * np.sin(angle))

    def command(self, t: float, dt: float, measured: Measured) -> Command:
        """See Gait."""
        del measured
        goal = self.body_m(t + dt)
        return Command(
            joints=self._legs.joints(self._feet - goal) + self._nought,
            rope_rates_m_s=-self._ropes @ (goal - self.body_m(t)) / dt,
        )
