"""Rules that keep a stance: haul what still holds, and stand ready for a rope that may part.

Both know from the foot loads what the slope pulls down: W = N tan(slope), N the sum of the foot loads in the first step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from testbed.envs.agents.base import Readings, Vector
from testbed.envs.keep import HAUL_M_S
from testbed.envs.observations import KEEP_TABLE
from testbed.machine.names import LEGS, SIDES

Array = NDArray[np.float64]
ROPE_N_M = 2.5e5
"""Stiffness that a rope of some thirty metres is hauled with (D: 327 kN/m at 30 m, less what the feet give)."""
STEP_S = 0.1
SLACK_SHARE = 0.25
"""A rope with less than this share of its first tension holds no more."""
MOST_N = 3.0e4
"""Highest pull that is asked for: a little less than a traction device's rating."""


@dataclass(frozen=True)
class Pulls:
    """What the rule wants of the ropes, as shares of the pull along the slope."""

    ready: float | None = None
    """Of both ropes together while both hold; None leaves them alone."""
    alone: float = 1.0
    """Of a rope that is left alone."""
    reaction_s: float = 0.3
    """Time in which a lack is to be made up for."""


class Hauling:
    """Hauls the rope that is left when the other holds no more; may pull harder beforehand. See Pulls."""

    def __init__(self, pulls: Pulls = Pulls()) -> None:
        self._pulls = pulls
        self._first: Array | None = None
        self._slope_n = 0.0

    def act(self, observation: Vector) -> Vector:
        """See Agent."""
        seen = Readings(observation, KEEP_TABLE)
        tension = seen.each("rope_tension", SIDES)
        if self._first is None:
            self._first = tension
            loads = seen.each("estimate_own", LEGS).sum()
            self._slope_n = float(loads * np.tan(-seen["attitude_pitch"]))
        latest = self._first + seen.each("control.pull_change", SIDES)
        action = np.zeros(len(SIDES) + len(LEGS), dtype=np.float32)
        action[: len(SIDES)] = self._speeds(latest) / HAUL_M_S
        return np.clip(action, -1.0, 1.0)

    def _speeds(self, tension: Array) -> Array:
        """Speeds of both ropes, m/s, + hauls in."""
        assert self._first is not None
        holds = tension > SLACK_SHARE * self._first
        if holds.all():
            if self._pulls.ready is None:
                return np.zeros(len(SIDES))
            wanted = np.full(len(SIDES), 0.5 * self._pulls.ready * self._slope_n)
        else:
            wanted = np.where(holds, self._pulls.alone * self._slope_n, self._first)
        lacking = np.minimum(wanted, MOST_N) - tension
        return np.asarray(lacking / ROPE_N_M / max(self._pulls.reaction_s, STEP_S))
