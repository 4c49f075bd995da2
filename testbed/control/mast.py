"""Keeps the mast at right angles to the slope: the vertical joints turn the body back to where it stood at first.

    d extension / dt = gain (pitch x - roll y),  x, y: where the foot stands in the body frame

Roll and pitch are those of the inertial unit less their mean over the first second, when the body lies parallel to the
mean slope. The four heights move as one plane: nothing is squeezed, no load goes from one diagonal to the other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.control.references import Command, Measured, Program
from testbed.parameters.names import VERTICAL

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
        self._level = 0.0, 0.0
        self._ticks = 0
        self._tilt = 0.0, 0.0
        self._added = np.zeros(4)
        self._now = Command()

    def update(self, t: float, dt: float, measured: Measured) -> Command:
        """See Program."""
        given = self._inner.update(t, dt, measured)
        seen_roll, seen_pitch, _ = measured.attitude_rad.tolist()
        (level_roll, level_pitch), (roll, pitch) = self._level, self._tilt
        if t < LEARN_S:
            self._ticks += 1
            share = 1.0 / self._ticks
            self._level = (
                level_roll + share * (seen_roll - level_roll),
                level_pitch + share * (seen_pitch - level_pitch),
            )
            return given
        share = dt / (SMOOTH_S + dt)
        roll += share * (seen_roll - level_roll - roll)
        pitch += share * (seen_pitch - level_pitch - pitch)
        self._tilt = roll, pitch
        rate = _NO_RATE
        if abs(roll) > DEAD_RAD or abs(pitch) > DEAD_RAD:
            rate = GAIN_1_S * (pitch * self._arm[:, 0] - roll * self._arm[:, 1])
            rate[np.abs(self._added + rate * dt) > MOST_M] = 0.0
        elif given.still and self._now.still:
            return self._now
        return self._with(given, rate, dt)

    def _with(self, given: Command, rate: Array, dt: float) -> Command:
        """The inner command with the heights as they are and as they change now."""
        now, feet = self._now, list(VERTICAL)
        now.reference[:] = given.reference
        now.rate[:] = given.rate
        if given.still:
            now.rate[:] = 0.0
        else:  # the caller moves on the command that it is given; the inner one is moved on here
            given.reference += given.rate * dt
        now.reference[feet] += self._added
        now.rate[feet] += rate
        now.rope_rate_m_s[:] = given.rope_rate_m_s
        now.carrying[:] = given.carrying
        now.still = given.still and not rate.any()
        self._added += rate * dt
        return now
