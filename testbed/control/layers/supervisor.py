"""Watches the contact states: a foot that has lost its load stops the drill and is lowered until it
carries again.

The drill waits while any foot that is meant to carry has lost its load, and for a moment
afterwards. Most feet are back once the thrust is gone; one that is not is lowered, slowly and one
at a time: through oil of 20 MN/m a millimetre too much takes 20 kN off its neighbours. What a foot
was lowered stays. It sees the detector's contact states and the inner command alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from testbed.control.command import Command, along_vertical
from testbed.control.measured import Measured
from testbed.machine.names import LEGS

LOWER_M_S = 0.003
"""Speed at which a lost foot is lowered (E)."""
PATIENCE_S = 0.2
"""A foot that is lost for this long is lowered (E)."""
LOWEST_M = 0.02
"""Farthest that a foot is lowered below what its program wants (E)."""
CALM_S = 0.5
"""The drill resumes when all feet have carried for this long (E)."""


class Supervisor:
    """A Layer; see the module's docstring. `stops` counts how often the drill was made to wait."""

    def __init__(self) -> None:
        self.stops = 0
        self._offset = np.zeros(len(LEGS))
        self._carried = np.zeros(len(LEGS), dtype=bool)
        self._calm_s = CALM_S
        self._lost_s = np.zeros(len(LEGS))

    def over(self, command: Command, t: float, dt: float, measured: Measured) -> Command:
        """See Layer."""
        carries = measured.contact.astype(bool)
        self._carried = (self._carried | carries) & command.stance
        lost = self._carried & ~carries
        self._watch(bool(lost.any()), dt)
        self._lost_s = np.where(lost, self._lost_s + dt, 0.0)
        step = np.zeros(len(LEGS))
        longest = int(np.argmax(self._lost_s))
        if self._lost_s[longest] >= PATIENCE_S:
            step[longest] = min(LOWER_M_S * dt, LOWEST_M - self._offset[longest])
        self._offset = self._offset + step
        waits = command.hold_drill or self._calm_s < CALM_S
        if waits != command.hold_drill:
            command = replace(command, hold_drill=waits)
        if not self._offset.any():
            return command
        return command.moved(along_vertical(self._offset), along_vertical(step / dt))

    def _watch(self, lost: bool, dt: float) -> None:
        if lost:
            self.stops += int(self._calm_s >= CALM_S)
            self._calm_s = 0.0
        else:
            self._calm_s = min(self._calm_s + dt, CALM_S)
