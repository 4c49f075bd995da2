"""Set points moved by hand: offsets on the vertical joints and wanted rope pulls laid over a gait.

The offsets follow their goals at a limited speed; the traction devices haul or pay out in
proportion to what a rope's measured tension lacks of its wanted pull.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from testbed.compiled import njit
from testbed.control.command import Command, along_vertical
from testbed.control.measured import Measured
from testbed.formats.arrays import Array
from testbed.machine.names import LEGS
from testbed.machine.scale import ROBOCLIMBER, Scale

PULL_GAIN_M_S_N = 1.0e-5
"""Rope pay-out speed per newton above the wanted pull: with 330 kN/m of rope a loop of 3.3 1/s
(E).
"""
PULL_SPEED_M_S = 0.06
"""Fastest hauling of the traction devices (E)."""
PULL_TOLERANCE_N = 50.0
"""Within this the traction device rests (about one standard deviation of the load pin) (E)."""
OFFSET_SPEED_M_S = 0.05
"""Fastest change of an offset (E)."""


class Hauling(NamedTuple):
    """How a machine's ropes are brought to wanted tensions."""

    gain_m_s_n: float
    speed_m_s: float
    tolerance_n: float


def hauling(scale: Scale) -> Hauling:
    """That of a machine of this size."""
    return Hauling(
        scale.speed / scale.force * PULL_GAIN_M_S_N,
        scale.speed * PULL_SPEED_M_S,
        scale.force * PULL_TOLERANCE_N,
    )


@njit
def haul(tension_n: Any, wanted_n: Any, by: Hauling, rates: Any) -> None:
    """Add to the rates (2) of the ropes' unstrained lengths, m/s (- hauls in), what brings tensions
    (2) there, N.
    """
    for index in range(rates.shape[0]):
        excess = tension_n[index] - wanted_n[index]
        if abs(excess) >= by.tolerance_n:
            rates[index] += min(max(by.gain_m_s_n * excess, -by.speed_m_s), by.speed_m_s)


class Trim:
    """A Layer; see the module's docstring."""

    def __init__(self, scale: Scale = ROBOCLIMBER) -> None:
        self._hauling, self._offset_m_s = hauling(scale), scale.speed * OFFSET_SPEED_M_S
        self.goal_m: Array = np.zeros(len(LEGS))
        """Wanted offsets of the vertical joints' set points, m, LEGS order."""
        self.pull_n: Array | None = None
        """Wanted tensions of the ropes, N, left, right; None leaves them to the gait."""
        self._offset = np.zeros(len(LEGS))

    def over(self, command: Command, t: float, dt: float, measured: Measured) -> Command:
        """See Layer."""
        most = self._offset_m_s * dt
        step = np.clip(self.goal_m - self._offset, -most, most)
        self._offset = self._offset + step
        if self.pull_n is not None:
            rates = command.rope_rates_m_s.copy()
            haul(measured.rope_tension, self.pull_n, self._hauling, rates)
            command = replace(command, rope_rates_m_s=rates)
        return command.moved(along_vertical(self._offset), along_vertical(step / dt))
