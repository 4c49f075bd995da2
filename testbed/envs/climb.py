"""Climbing: the crawl's set points with the agent's offsets and rope pulls over them; paid for the way up the slope."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from testbed.envs.base import RoboclimberEnv
from testbed.envs.rewards import Truth, Weights
from testbed.scenario.scenario import Scenario

Array = NDArray[np.float64]
WAY_1_M = 100.0
"""Reward per metre up the slope (E)."""


class ClimbEnv(RoboclimberEnv):
    """`Roboclimber/Climb-v0`: the scenario crawl_slope_30 as an environment."""

    weights = ("friction_use", "lost", "effort", "end")

    def _begin(self, spec: Scenario) -> None:
        super()._begin(spec)
        slope = math.radians(spec.terrain.slope_deg)
        self._up_in_world = np.array([math.cos(slope), 0.0, math.sin(slope)])

    def _reward(self, truth: Truth, action: Array, ended: bool) -> float:
        return climbing_reward(
            truth, float(truth.way_in_world_m @ self._up_in_world), action, ended, self._weights
        )


def climbing_reward(
    truth: Truth, up_m: float, action: Array, ended: bool, weights: Weights
) -> float:
    """Metres up the slope, less friction use, lost feet, effort and a bad end."""
    return float(
        WAY_1_M * up_m
        - weights.friction_use * min(truth.friction_use, 2.0)
        - weights.lost * truth.feet_lost
        - weights.effort * float(np.mean(action**2))
        - weights.end * ended
    )
