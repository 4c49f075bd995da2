"""The oracle's agent that climbs: it has tried its decisions out on the very case."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Self

import numpy as np

from testbed.benchmarks.control_tasks.agents import Vector
from testbed.formats.arrays import Array

EACH = 3
"""Numbers of a decision: stride, height and haste, as `Roboclimber/Climb-v1` takes them."""
TURN = 8
"""Decisions, groups of swings, before the second half of a plan begins: half of an episode."""


class ClimbPlan:
    """Six numbers: the decision that holds for the first half of an episode, and that of the
    second.
    """

    def __init__(self, plan: Array) -> None:
        self._decided = 0
        self._follow(plan)

    def with_plan(self, plan: Array) -> Self:
        """The same agent, at the instant where it is, with another plan for what comes."""
        other = copy.copy(self)
        other._follow(plan)
        return other

    def _follow(self, plan: Array) -> None:
        self._halves = np.clip(plan, -1.0, 1.0).reshape(2, EACH).astype(np.float32)

    def act(self, observation: Vector) -> Vector:
        """See Agent."""
        del observation
        half = self._halves[0 if self._decided < TURN else 1]
        self._decided += 1
        return np.asarray(half.copy())


def no_plan(observations: Sequence[Vector]) -> tuple[float, ...]:
    """What others do is no plan of this oracle's: it climbs by a gait that they do not have."""
    del observations
    return ()
