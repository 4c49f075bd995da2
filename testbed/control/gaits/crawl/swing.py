"""The way of a swinging foot: up, over, down to where the search for the ground begins; and that
search.

Each of the three takes the time that its joints need. Rotation and radial joint go over while the
foot still rises and when it already comes down, but not before it is clear of the ground.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np

from testbed.control.gaits.crawl.known_ground import ExpectedGround
from testbed.control.gaits.crawl.pace import RAMP, SWING_RAMP, Pace, progress
from testbed.formats.arrays import Array
from testbed.machine.names import ROTATION, VERTICAL
from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.robot.robot import LegKinematics

# Seeking the ground with a foot: how fast, how deep, and when it has been met, by the force
# estimate alone.


TOUCH_SHARE = 0.12
"""A foot has met the ground when its estimated load rises by this share of the robot's load on the
slope (E).
"""
LEAST_TOUCH_N = 400.0
"""A smaller rise tells nothing (E)."""
MOST_TOUCH_N = 1500.0
"""A larger rise always tells a touch (E)."""
SLOWEST_SEARCH_M_S = 0.010
"""Least speed at which the ground is sought (E)."""
SEARCH_M_S = 0.06
"""Speed at which the ground is sought on level ground; slower in proportion to what the feet carry:
until the touch is known, the leg goes on into 10 MN/m of oil and ground, and too hard a touch lifts
the feet beside it."""
FAR_SEARCH_M_S = 0.08
"""Speed of the search while the foot is still far above the expected ground, slower with the root
of what the feet carry (E).
"""
FAR_SHARE = 0.5
"""Far is further up than this share of what the ground may lie higher: that is rare (E)."""
SEARCH_ABOVE_M = 0.010
"""The search begins this far above the expected ground, besides what it may lie higher (E)."""
SEARCH_BELOW_M = 0.06
"""The search ends this far below the expected ground, besides the ground's steps (E)."""
BASE_TIME_S = 0.15
"""Time constant with which the load of a foot in the air is learnt."""
STEADY_S = 0.2
"""Until a search has lasted so long, friction is still turning over in the leg and only a large
rise counts.
"""


@dataclass(frozen=True)
class Haste:
    """So many times as fast as usual the ground is sought."""

    near: float = 1.0
    """Where it may be met, if it may lie higher than expected, but no faster than far above it:
    before it is met, friction has turned over in the leg, and a smaller rise of the load tells the
    touch.
    """
    far: float = 1.0
    """Far above the expected ground."""
    most_s: float = np.inf
    """Where the ground can lie no higher than expected, a foot comes down to it from where the
    search begins within this time, s, however little the feet carry.
    """


AS_USUAL = Haste()


class GroundSearch:
    """One foot's search at a time. Heights are of the path frame, m."""

    def __init__(
        self, carried_n: float, lightness: float, ground_steps_m: float, scale: Scale = ROBOCLIMBER
    ) -> None:
        """carried_n: all feet's load; lightness: its share of the weight; ground_steps_m: to be
        reckoned with.
        """
        self._surely_n = scale.force * MOST_TOUCH_N
        least_n = scale.force * LEAST_TOUCH_N
        self.touch_n = min(max(TOUCH_SHARE * carried_n, least_n), self._surely_n)
        """Rise of the load that tells a touch."""
        self._above_m = scale.length * SEARCH_ABOVE_M
        self._below_m = scale.length * SEARCH_BELOW_M + ground_steps_m
        self._near_m_s: float = scale.speed * max(SEARCH_M_S * lightness, SLOWEST_SEARCH_M_S)
        self._far_m_s: float = max(scale.speed * FAR_SEARCH_M_S * lightness**0.5, self._near_m_s)
        self._base_n = 0.0

    def first_m(self, ground: ExpectedGround, share: float = 1.0) -> float:
        """Where a search begins that is above this share of what the ground may lie higher."""
        return ground.height_m + (self._above_m + share * ground.steps_m)

    def high_m(self, start_m: float, ground: ExpectedGround, lift_m: float, over: bool) -> float:
        """How high a foot from `start_m` is lifted: by lift_m over all that the ground may rise by,
        or (not `over`) over the ground that is expected, and clear of what it may rise by.
        """
        first = self.first_m(ground)
        if over:
            return max(start_m, first) + lift_m
        return max(max(start_m, self.first_m(ground, 0.0)) + lift_m, first)

    def speed_m_s(self, height_m: float, ground: ExpectedGround, haste: Haste) -> float:
        """How fast the foot may come down at a height."""
        far_m_s = haste.far * self._far_m_s
        if height_m > ground.height_m + (self._above_m + FAR_SHARE * ground.steps_m):
            return far_m_s
        if ground.steps_m > 0.0:
            return min(haste.near * self._near_m_s, far_m_s)
        return max(self._near_m_s, self._above_m / haste.most_s)

    def lowest_m(self, ground: ExpectedGround) -> float:
        """Where the search ends."""
        return ground.height_m - self._below_m

    def begin(self, load_n: float) -> None:
        """The foot is in the air: what is estimated now is its load without ground."""
        self._base_n = load_n

    def met(self, load_n: float, since_s: float, dt: float) -> bool:
        """Whether the load tells a touch, `since_s` after the search began; if not, it is learnt
        for dt seconds.
        """
        rise = load_n - self._base_n
        if rise > (self.touch_n if since_s >= STEADY_S else self._surely_n):
            return True
        self._base_n += rise * dt / BASE_TIME_S
        return False


CLEAR = 0.3
"""Usual share of the time of rising after which a foot goes over (E)."""


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
    clear: float = CLEAR
    """Share of the time of rising after which the foot goes over, and of the time of coming down at
    which it is there.
    """
    ramp: float = SWING_RAMP
    """Share of each part's time in which its speed rises, and falls."""
    rise_s: float = 1.0
    over_s: float = 1.0
    lower_s: float = 1.0

    @cached_property
    def duration_s(self) -> float:
        """Of the whole way."""
        return max(
            self.clear * (self.rise_s + self.lower_s) + self.over_s, self.rise_s + self.lower_s
        )

    @cached_property
    def arrival(self) -> float:
        """Share of the whole way's time from which the foot slows down towards its end."""
        return 1.0 - self.ramp * self.lower_s / self.duration_s

    def timed(self, pace: Pace) -> Swing:
        """The same way in the least time that the leg's own cylinders allow."""
        first, last = self._ends
        change = np.abs(last - first)
        *across, up = range(ROTATION[self.leg], VERTICAL[self.leg] + 1)
        return replace(
            self,
            rise_s=pace.free_s(up, self.high_m - self.start[2], self.ramp),
            over_s=max(
                pace.free_s(axis, change[index], self.ramp) for index, axis in enumerate(across)
            ),
            lower_s=pace.free_s(up, self.high_m - self.end[2], self.ramp),
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
        begin, end = self.clear * self.rise_s, total - self.clear * self.lower_s
        over = progress((t - begin) / (end - begin), self.ramp)
        first, last = self._ends
        if body_then is not None:
            last = self._joints(self.end - body_then)
        x, y, _ = self.legs.leg_foot(self.leg, (first + over * (last - first)).tolist())
        up = progress(t / self.rise_s, self.ramp)
        down = progress((t - total + self.lower_s) / self.lower_s, self.ramp)
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


class Activity(Enum):
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


IN_THE_AIR = (Activity.UNLOAD, Activity.SWING, Activity.SEARCH)
"""Phases in which the leg is not meant to carry."""


@dataclass(frozen=True)
class BodyWay:
    """A straight way of the body. Places are (3,) in the path frame, m."""

    start: Array
    end: Array
    duration_s: float
    ramp: float = RAMP
    """Share of the time in which the speed rises, and falls."""

    def at(self, t: float) -> Array:
        """(3) where the body is meant to be t seconds after it set off."""
        return np.asarray(
            self.start + progress(t / self.duration_s, self.ramp) * (self.end - self.start)
        )


NO_GROUND = ExpectedGround(0.0, 0.0)
"""Of phases that seek none."""


@dataclass
class Phase:
    """One piece of the walk."""

    doing: Activity
    duration_s: float
    leg: int = -1
    way: BodyWay | None = None
    """The way that the body sets off on when the phase begins; None: it goes on as it was."""
    swing: Swing | None = None
    ground: ExpectedGround = NO_GROUND
    """What a swing and a search expect: they begin to seek it above, and give up below."""
    tries: int = 1
    """Which search for this foothold it is, or was before this seat."""
