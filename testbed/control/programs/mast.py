"""Keeps the mast at right angles to the slope: the vertical joints turn the body back to where it stood at first.

    d extension / dt = gain (turn_y x - turn_x y),  x, y: where the foot stands in the body frame

The tilt is the turn from the mean attitude of the first second, when the body lies parallel to the mean slope, about
the body's own axes: on a steep slope a turn about its normal changes the roll angle, but tilts nothing. The four
heights move as one plane: nothing is squeezed, no load goes from one diagonal to the other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.control.programs.references import Command, Measured, Program
from testbed.machine.names import VERTICAL
from testbed.robot.attitude import rotation_from_attitude, small_turn, write_rotation

Array = NDArray[np.float64]

LEARN_S = 1.0
SMOOTH_S = 0.4
"""Time constant of the tilt that is acted on: the blows shake the inertial unit."""
DEAD_RAD = 1.5e-3
"""Tilt that is left alone (0.09 degrees): below, the valves' dead band would make the body hunt."""
GAIN_1_S = 0.4
MOST_M = 0.08
"""Furthest that a leg is moved."""
_NO_RATE = np.zeros(4)


class KeepMast:
    """A program that takes another one's set points and adds the mast's heights to its vertical joints."""

    def __init__(self, inner: Program, feet_in_body: Array) -> None:
        self._inner = inner
        self._arm = feet_in_body[:, :2].copy()
        self._arm -= self._arm.mean(axis=0)
        self._level = np.zeros(3)
        self._ticks = 0
        self._upright, self._turned = np.eye(3), np.empty((3, 3))
        self._tilt = 0.0, 0.0
        self._added = np.zeros(4)
        self._now = Command()

    def update(self, t: float, dt: float, measured: Measured) -> Command:
        """See Program."""
        given = self._inner.update(t, dt, measured)
        if t < LEARN_S:
            self._ticks += 1
            self._level += (measured.attitude_rad - self._level) / self._ticks
            self._upright = rotation_from_attitude(self._level)
            return given
        write_rotation(measured.attitude_rad, self._turned)
        seen_x, seen_y, _ = small_turn(self._upright.T @ self._turned)
        share = dt / (SMOOTH_S + dt)
        x, y = self._tilt
        self._tilt = x, y = x + share * (seen_x - x), y + share * (seen_y - y)
        rate = _NO_RATE
        if abs(x) > DEAD_RAD or abs(y) > DEAD_RAD:
            rate = GAIN_1_S * (y * self._arm[:, 0] - x * self._arm[:, 1])
            rate[np.abs(self._added + rate * dt) > MOST_M] = 0.0
        elif given.still and self._now.still:
            return self._now
        return self._with(given, rate, dt)

    def _with(self, given: Command, rate: Array, dt: float) -> Command:
        """The inner command with the heights as they are and as they change now."""
        now, feet = self._now, list(VERTICAL)
        stood = not now.rate.any()
        now.follow(given)
        if given.still:
            now.rate[:] = 0.0
        else:  # the caller moves on the command that it is given; the inner one is moved on here
            given.reference += given.rate * dt
        now.reference[feet] += self._added
        now.rate[feet] += rate
        now.still = given.still and stood and not rate.any()
        self._added += rate * dt
        return now
