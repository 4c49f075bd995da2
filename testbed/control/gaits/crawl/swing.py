"""The way of a swinging foot: up, over, down to where the search for the ground begins.

Each of the three takes the time that its joints need. Rotation and radial joint go over while the
foot still rises and when it already comes down, but not before it is clear of the ground.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np

from testbed.control.gaits.crawl.pace import SWING_RAMP, Pace, progress
from testbed.formats.arrays import Array
from testbed.machine.names import ROTATION, VERTICAL
from testbed.robot.robot import LegKinematics

CLEAR = 0.3
"""Share of the time of rising after which the foot goes over, and of the time of coming down at
which it is there.
"""


@dataclass(frozen=True)
class Swing:
    """Way of foot `leg` from `start` to `end` (3), path frame, m, with the body going from
    body_from to body_to (3).
    """

    legs: LegKinematics
    leg: int
    start: Array
    end: Array
    body_from: Array
    body_to: Array
    high_m: float
    """Height of the way's top, path frame."""
    rise_s: float = 1.0
    over_s: float = 1.0
    lower_s: float = 1.0

    @cached_property
    def duration_s(self) -> float:
        """Of the whole way."""
        return max(CLEAR * (self.rise_s + self.lower_s) + self.over_s, self.rise_s + self.lower_s)

    @cached_property
    def arrival(self) -> float:
        """Share of the whole way's time from which the foot slows down towards its end."""
        return 1.0 - SWING_RAMP * self.lower_s / self.duration_s

    def timed(self, pace: Pace) -> Swing:
        """The same way in the least time that the leg's own cylinders allow."""
        first, last = self._ends
        change = np.abs(last - first)
        *across, up = range(ROTATION[self.leg], VERTICAL[self.leg] + 1)
        return replace(
            self,
            rise_s=pace.free_s(up, self.high_m - self.start[2]),
            over_s=max(pace.free_s(axis, change[index]) for index, axis in enumerate(across)),
            lower_s=pace.free_s(up, self.high_m - self.end[2]),
        )

    def slower(self, times: float) -> Swing:
        """The same way in so many times the time."""
        rise, over, lower = (
            times * duration for duration in (self.rise_s, self.over_s, self.lower_s)
        )
        return replace(self, rise_s=rise, over_s=over, lower_s=lower)

    def foot(self, t: float, body: Array, body_then: Array | None = None) -> Array:
        """(3) place t seconds after the start, the body at `body` (3), path frame.

        body_then (3): where the body will be at the end, if not where it was meant to be.
        """
        total = self.duration_s
        begin, end = CLEAR * self.rise_s, total - CLEAR * self.lower_s
        over = progress((t - begin) / (end - begin), SWING_RAMP)
        first, last = self._ends
        if body_then is not None:
            last = self._joints(self.end - body_then)
        x, y, _ = self.legs.leg_foot(self.leg, (first + over * (last - first)).tolist())
        up = progress(t / self.rise_s, SWING_RAMP)
        down = progress((t - total + self.lower_s) / self.lower_s, SWING_RAMP)
        start, end = self._heights
        height = start + (self.high_m - start) * up + (end - self.high_m) * down
        return np.array([body[0] + x, body[1] + y, height])

    @cached_property
    def _heights(self) -> tuple[float, float]:
        """Of start and end, m."""
        return float(self.start[2]), float(self.end[2])

    @cached_property
    def _ends(self) -> tuple[Array, Array]:
        """(3) joints of this leg at the start and at the end."""
        return self._joints(self.start - self.body_from), self._joints(self.end - self.body_to)

    def _joints(self, foot: Array) -> Array:
        """(3) joints of this leg with its foot at `foot` (3), body frame."""
        own = slice(ROTATION[self.leg], VERTICAL[self.leg] + 1)
        return np.asarray(self.legs.joints(np.tile(foot, (4, 1)))[own])


# The pieces that a walk is made of.


class Doing(Enum):
    """What the robot is at."""

    SHIFT = "shift"
    """All feet stand; the body goes its way to the end."""
    UNLOAD = "unload"
    """A foot is taken off the ground, gently."""
    SWING = "swing"
    """The foot goes over to its next place."""
    SEARCH = "search"
    """The foot is lowered until it meets the ground."""
    SEAT = "seat"
    """The foot is given time to carry."""


IN_THE_AIR = (Doing.UNLOAD, Doing.SWING, Doing.SEARCH)
"""Phases in which the leg is not meant to carry."""


@dataclass(frozen=True)
class BodyWay:
    """A straight way of the body. Places are (3,) in the path frame, m."""

    start: Array
    end: Array
    duration_s: float

    def at(self, t: float) -> Array:
        """(3) where the body is meant to be t seconds after it set off."""
        return np.asarray(self.start + progress(t / self.duration_s) * (self.end - self.start))


@dataclass
class Phase:
    """One piece of the walk."""

    doing: Doing
    duration_s: float
    leg: int = -1
    way: BodyWay | None = None
    """The way that the body sets off on when the phase begins; None: it goes on as it was."""
    swing: Swing | None = None
    old_m: float = 0.0
    """Height of the old foothold, path frame: a search begins above it and ends below it."""
    tries: int = 1
    """Which search for this foothold it is, or was before this seat."""
