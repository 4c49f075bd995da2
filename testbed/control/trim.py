"""Set points moved by hand: a program with offsets on the vertical joints and wanted rope pulls laid over it.

The offsets follow their goals at a limited speed; the traction devices haul or pay out in proportion to what a rope's
measured tension lacks of its wanted pull.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.control.references import Command, Measured, Program
from testbed.parameters.names import LEGS, VERTICAL

Array = NDArray[np.float64]
PULL_GAIN_M_S_N = 1.0e-5
"""Rope pay-out speed per newton above the wanted pull: with 330 kN/m of rope a loop of 3.3 1/s (E)."""
PULL_SPEED_M_S = 0.06
"""Fastest hauling of the traction devices (E)."""
PULL_TOLERANCE_N = 50.0
"""Within this the traction device rests (about one standard deviation of the load pin) (E)."""
OFFSET_SPEED_M_S = 0.05
"""Fastest change of an offset (E)."""


def rope_rate(tension_n: Array, wanted_n: Array) -> Array:
    """Rate (2,) of the ropes' unstrained lengths, m/s (negative hauls in), that brings the tensions to those wanted."""
    excess = tension_n - wanted_n
    excess = np.where(np.abs(excess) < PULL_TOLERANCE_N, 0.0, excess)
    return np.asarray(np.clip(PULL_GAIN_M_S_N * excess, -PULL_SPEED_M_S, PULL_SPEED_M_S))


class Trim:
    """A program on top of another: the inner program's set points plus `goal_m` (4) on the vertical joints."""

    def __init__(self, inner: Program) -> None:
        self.inner = inner
        self.goal_m: Array = np.zeros(len(LEGS))
        """Wanted offsets of the vertical joints' set points, m, LEGS order."""
        self.pull_n: Array | None = None
        """Wanted tensions of the ropes, N, left, right; None leaves them to the inner program."""
        self._offset = np.zeros(len(LEGS))
        self._now = Command()

    def update(self, t: float, dt: float, measured: Measured) -> Command:
        """See Program."""
        command, out = self.inner.update(t, dt, measured), self._now
        step = np.clip(self.goal_m - self._offset, -OFFSET_SPEED_M_S * dt, OFFSET_SPEED_M_S * dt)
        out.reference[:] = command.reference
        out.rate[:] = command.rate
        out.reference[list(VERTICAL)] += self._offset
        out.rate[list(VERTICAL)] += step / dt
        out.carrying[:] = command.carrying
        out.rope_rate_m_s[:] = command.rope_rate_m_s
        if self.pull_n is not None:
            out.rope_rate_m_s[:] += rope_rate(measured.rope_tension_n, self.pull_n)
        self._offset += step
        command.reference += command.rate * dt
        return out
