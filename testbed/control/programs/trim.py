"""Set points moved by hand: a program with offsets on the vertical joints and wanted rope pulls laid over it.

The offsets follow their goals at a limited speed; the traction devices haul or pay out in proportion to what a rope's
measured tension lacks of its wanted pull.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.control.programs.references import Command, Measured, Program
from testbed.machine.names import LEGS

Array = NDArray[np.float64]
PULL_GAIN_M_S_N = 1.0e-5
"""Rope pay-out speed per newton above the wanted pull: with 330 kN/m of rope a loop of 3.3 1/s (E)."""
PULL_SPEED_M_S = 0.06
"""Fastest hauling of the traction devices (E)."""
PULL_TOLERANCE_N = 50.0
"""Within this the traction device rests (about one standard deviation of the load pin) (E)."""
OFFSET_SPEED_M_S = 0.05
"""Fastest change of an offset (E)."""


@njit
def haul(tension_n: Any, wanted_n: Any, rates: Any) -> None:
    """Add to the rates (2) of the ropes' unstrained lengths, m/s (- hauls in), what brings tensions (2) there, N."""
    for k in range(rates.shape[0]):
        excess = tension_n[k] - wanted_n[k]
        if abs(excess) >= PULL_TOLERANCE_N:
            rates[k] += min(max(PULL_GAIN_M_S_N * excess, -PULL_SPEED_M_S), PULL_SPEED_M_S)


@njit
def move_offsets(goal: Any, offset: Any, dt: float, reference: Any, rate: Any) -> None:
    """Lay `offset` (4) over the vertical set points and rates (12), and let it follow its goal (4)."""
    for leg in range(len(LEGS)):
        step = min(max(goal[leg] - offset[leg], -OFFSET_SPEED_M_S * dt), OFFSET_SPEED_M_S * dt)
        reference[3 * leg + 2] += offset[leg]
        rate[3 * leg + 2] += step / dt
        offset[leg] += step


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
        out.follow(command)
        move_offsets(self.goal_m, self._offset, dt, out.reference, out.rate)
        if self.pull_n is not None:
            haul(measured.rope_tension_n, self.pull_n, out.rope_rate_m_s)
        command.reference += command.rate * dt
        return out
