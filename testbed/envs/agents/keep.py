"""Agents that keep a stance: one hauls what still holds, one also stands ready for a rope that may
part.

Both know from the foot loads what the slope pulls down: W = N tan(slope), N the sum of the foot
loads in the first step. With both ropes pulling c W the feet have (c - 1) W to hold up the slope;
in the moment in which one of them parts, (1 - c / 2) W down the slope. The secure pull makes the
larger of the two as small as can be, c = 4/3, and leaves the feet a part of the least friction that
has to be reckoned with.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.envs.agents.base import Readings, Vector
from testbed.envs.keep import HAUL_M_S
from testbed.envs.observations import KEEP_TABLE
from testbed.machine.names import LEGS, SIDES

Array = NDArray[np.float64]
ROPE_N_M = 2.5e5
"""Stiffness that a rope of some thirty metres is hauled with (D: 327 kN/m at 30 m, less what the
feet give).
"""
STEP_S = 0.1
SLACK_SHARE = 0.25
"""A rope with less than this share of its first tension holds no more."""
MOST_N = 3.0e4
"""Highest pull that is asked for: a little less than a traction device's rating."""


DIAGONAL = np.array([1.0, -1.0, -1.0, 1.0])
EVEN_SHARE, EVENING = 0.1, 0.3
"""Share of the load by which one diagonal may carry more than the other, and how fast the rest is
evened out (E).
"""
LEAST_FRICTION, USED_SHARE = 0.3, 0.7
"""Friction that has to be reckoned with on wet rock (D), and the share of it that may be used up
the slope (E).
"""
REACTION_S = 0.3
"""Time in which a lack of pull is to be made up for (E)."""


def secure_share(slope: float, least_friction: float) -> float:
    """Pull of both ropes together over the slope's pull W; slope: its tangent."""
    return min(4.0 / 3.0, 1.0 + USED_SHARE * least_friction / slope)


class Hauling:
    """Hauls the rope that is left when the other holds no more, and hauls back one that has
    slipped.
    """

    reaction_s = REACTION_S
    """Time in which a lack of pull is made up for."""

    def __init__(self) -> None:
        self._first: Array | None = None
        self._slope = self._slope_n = 0.0

    def act(self, observation: Vector) -> Vector:
        """See Agent."""
        seen = Readings(observation, KEEP_TABLE)
        tension = seen.each("rope_tension", SIDES)
        if self._first is None:
            self._first = tension
            self._slope = float(np.tan(-seen["attitude_pitch"]))
            self._slope_n = float(seen.each("estimate_own", LEGS).sum()) * self._slope
        latest = self._first + seen.each("control.pull_change", SIDES)
        holds = latest > SLACK_SHARE * self._first
        wanted = self._ready(latest) if holds.all() else np.where(holds, self._slope_n, self._first)
        lacking = np.minimum(wanted, MOST_N) - latest
        action = np.zeros(len(SIDES) + len(LEGS), dtype=np.float32)
        action[: len(SIDES)] = lacking / ROPE_N_M / self.reaction_s / HAUL_M_S
        action[len(SIDES) :] = self._raised(seen.each("estimate_own", LEGS))
        return np.clip(action, -1.0, 1.0)

    def _left(self) -> float:
        """Pull that is wanted of a rope that is left alone, N: all of the slope's."""
        return self._slope_n

    def _raised(self, loads: Array) -> Array:
        """Increments of the vertical set points (4) as actions, from the feet's loads (4), N:
        none.
        """
        return np.zeros(len(loads))

    def _ready(self, tension: Array) -> Array:
        """Pulls (2) that are wanted while both ropes hold, N: those that they have."""
        return tension


class Secure(Hauling):
    """The same, and pulls so that the feet can hold what comes when either rope parts; see the
    module's docstring.
    """

    def __init__(self, least_friction: float = LEAST_FRICTION) -> None:
        super().__init__()
        self._least_friction = least_friction

    def _ready(self, tension: Array) -> Array:
        del tension
        share = secure_share(self._slope, self._least_friction)
        return np.full(len(SIDES), 0.5 * share * self._slope_n)

    def _raised(self, loads: Array) -> Array:
        """Both diagonals are to carry alike: only then do all four feet hold against a turn on one
        rope.
        """
        uneven = float(DIAGONAL @ loads) / max(float(loads.sum()), 1.0)
        if abs(uneven) < EVEN_SHARE:
            return np.zeros(len(loads))
        return np.asarray(-EVENING * uneven * DIAGONAL)
