"""Seeking the ground with a foot: how fast, how deep, and when it has been met, by the force
estimate alone.
"""

from __future__ import annotations

from testbed.machine.scale import ROBOCLIMBER, Scale

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
"""The same while the foot is still far above its old foothold, slower with the root of what the
feet carry (E).
"""
FAR_SHARE = 0.5
"""Far is further up than this share of the ground's steps: ground so high is rare (E)."""
SEARCH_ABOVE_M = 0.010
"""The search begins this far above the old foothold, besides the ground's steps (E)."""
SEARCH_BELOW_M = 0.06
"""The search ends this far below the old foothold, besides the ground's steps (E)."""
BASE_TIME_S = 0.15
"""Time constant with which the load of a foot in the air is learnt."""
STEADY_S = 0.2
"""Until a search has lasted so long, friction is still turning over in the leg and only a large
rise counts.
"""


class GroundSearch:
    """One foot's search at a time. Heights are of the path frame, m; `old_m` is that of the foot's
    last foothold.
    """

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
        self.above_m = scale.length * SEARCH_ABOVE_M + ground_steps_m
        """How far above the old foothold a search begins."""
        self._far_m = scale.length * SEARCH_ABOVE_M + FAR_SHARE * ground_steps_m
        self._below_m = scale.length * SEARCH_BELOW_M + ground_steps_m
        self._near_m_s = scale.speed * max(SEARCH_M_S * lightness, SLOWEST_SEARCH_M_S)
        self._far_m_s = max(scale.speed * FAR_SEARCH_M_S * lightness**0.5, self._near_m_s)
        self._base_n = 0.0

    def speed_m_s(self, height_m: float, old_m: float) -> float:
        """How fast the foot may come down at a height."""
        return self._far_m_s if height_m > old_m + self._far_m else self._near_m_s

    def lowest_m(self, old_m: float) -> float:
        """Where the search ends."""
        return old_m - self._below_m

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
