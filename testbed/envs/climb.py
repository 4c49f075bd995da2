"""Climbing: the crawl's set points with the agent's offsets and rope pulls over them; paid for the
way up the slope.
"""

from __future__ import annotations

import math
from typing import Any

import gymnasium
import numpy as np

from testbed.envs.base import RoboclimberEnv
from testbed.envs.rewards import EFFORT, END, FRICTION_USE, LOST, Term, Truth, holding_amounts
from testbed.formats.arrays import Array
from testbed.scenario.scenario import Scenario

WAY = Term("way", "way of the body up the slope", "m", 100.0)
OUTDATED = "Climb-v0 pays a quick slide better than a climb: kept for comparison, train on Climb-v1"


class ClimbEnv(RoboclimberEnv):
    """`Roboclimber/Climb-v0`: the scenario crawl_slope_30 as an environment; outdated."""

    terms = (WAY, FRICTION_USE, LOST, EFFORT, END)

    def __init__(self, **arguments: Any) -> None:
        gymnasium.logger.warn(OUTDATED)
        super().__init__(**arguments)

    def _begin(self, spec: Scenario) -> None:
        super()._begin(spec)
        slope = math.radians(spec.terrain.slope_deg)
        self._up_in_world = np.array([math.cos(slope), 0.0, math.sin(slope)])

    def _amounts(self, truth: Truth, action: Array, ended: bool) -> dict[str, float]:
        amounts = holding_amounts(truth, action, ended)
        kept = {term.name: amounts[term.name] for term in self.terms if term is not WAY}
        return {"way": float(truth.way_in_world_m @ self._up_in_world), **kept}
