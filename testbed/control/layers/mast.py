"""Keeps the mast at right angles to the slope: the vertical joints turn the body back to where it
stood at first.

    d extension / dt = gain (turn_y x - turn_x y),  x, y: where the foot stands in the body frame

The tilt is the turn from the mean attitude of the first second, when the body lies parallel to the
mean slope, about the body's own axes: on a steep slope a turn about its normal changes the roll
angle, but tilts nothing. The four
heights move as one plane: nothing is squeezed, no load goes from one diagonal to the other.
"""

from __future__ import annotations

import numpy as np

from testbed.control.command import Command, along_vertical
from testbed.control.measured import Measured
from testbed.formats.arrays import Array
from testbed.machine.names import AXES
from testbed.robot.attitude import rotation_from_attitude, small_turn, write_rotation

LEARN_S = 1.0
"""The attitude at the start is the mean over this time (E)."""
SMOOTH_S = 0.4
"""Time constant of the tilt that is acted on: the blows shake the inertial unit."""
DEAD_RAD = 1.5e-3
"""Tilt that is left alone (0.09 degrees): below, the valves' dead band would make the body hunt."""
GAIN_1_S = 0.4
"""Speed of the correction per tilt (E)."""
MOST_M = 0.08
"""Furthest that a leg is moved."""


class KeepMast:
    """A Layer that adds the mast's heights to the vertical joints. `feet_in_body` (4, 3) at the
    start, m.
    """

    def __init__(self, feet_in_body: Array) -> None:
        self._arm = feet_in_body[:, :2] - feet_in_body[:, :2].mean(axis=0)
        self._level = np.zeros(3)
        self._ticks = 0
        self._upright, self._turned = np.eye(3), np.empty((3, 3))
        self._tilt = 0.0, 0.0
        self._added = np.zeros(4)
        self._given: Command | None = None
        self._last: Command | None = None
        """What was given and what came of it where the heights were at rest."""

    def over(self, command: Command, t: float, dt: float, measured: Measured) -> Command:
        """See Layer."""
        if t < LEARN_S:
            self._ticks += 1
            self._level += (measured.attitude - self._level) / self._ticks
            self._upright = rotation_from_attitude(self._level)
            return command
        rate = self._rate(measured.attitude, dt)
        if rate is None:
            if command is not self._given or self._last is None:
                self._given = command
                self._last = command.moved(along_vertical(self._added), np.zeros(len(AXES)))
            return self._last
        self._last = None
        self._added = self._added + rate * dt
        return command.moved(along_vertical(self._added), along_vertical(rate))

    def _rate(self, attitude: Array, dt: float) -> Array | None:
        """(4) how fast the heights change, m/s; None where the mast stands as it should."""
        write_rotation(attitude, self._turned)
        seen_x, seen_y, _ = small_turn(self._upright.T @ self._turned)
        share = dt / (SMOOTH_S + dt)
        x, y = self._tilt
        self._tilt = x, y = x + share * (seen_x - x), y + share * (seen_y - y)
        if abs(x) <= DEAD_RAD and abs(y) <= DEAD_RAD:
            return None
        rate = GAIN_1_S * (y * self._arm[:, 0] - x * self._arm[:, 1])
        rate[np.abs(self._added + rate * dt) > MOST_M] = 0.0
        return np.asarray(rate)
