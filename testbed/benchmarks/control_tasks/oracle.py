"""The oracle: knows the truth and the future of its case, and searches its plan on that very case.

The search is the cross-entropy method: draw plans around the best so far, keep the best quarter,
narrow down. Its budget is a number of episodes, which the result states.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.envs.agents.base import Vector
from testbed.envs.agents.drill_hole import action_of
from testbed.envs.agents.keep import DIAGONAL, STEP_S, Secure

Array = NDArray[np.float64]
POPULATION, KEPT = 8, 2
"""Plans drawn a round, and how many of them the next round is drawn around."""
FRONT = np.array([1.0, 1.0, -1.0, -1.0])
LEAST_SPREAD = 0.1
"""A spread never falls below this share of the first one."""


@dataclass(frozen=True)
class Found:
    """What a search has found: the best plan, its score, and the best score after so many
    episodes.
    """

    plan: tuple[float, ...]
    score: float
    history: tuple[float, ...]


def search(
    score: Callable[[Array], float],
    starts: tuple[tuple[float, ...], ...],
    spread: tuple[float, ...],
    budget: int,
    seed: int,
) -> Found:
    """The best of `budget` plans by `score`: those of `starts` first, then rounds drawn around the
    best.
    """
    rng = np.random.default_rng([seed, 5])
    tried: list[tuple[float, tuple[float, ...]]] = []
    history: list[float] = []

    def attempt(plan: tuple[float, ...]) -> None:
        tried.append((score(np.array(plan)), plan))
        history.append(max(found for found, _ in tried))

    for start in starts[:budget]:
        attempt(start)
    wide = np.array(spread)
    while len(history) < budget:
        best = [np.array(plan) for _, plan in sorted(tried, reverse=True)[:KEPT]]
        for _ in range(min(POPULATION, budget - len(history))):
            centre = best[int(rng.integers(len(best)))]
            attempt(tuple((centre + wide * rng.standard_normal(len(wide))).tolist()))
        wide = np.maximum(0.7 * wide, LEAST_SPREAD * np.array(spread))
    top, plan = max(tried)
    return Found(plan, top, tuple(history))


class KeepPlan(Secure):
    """Six numbers: pull of the left and right rope before a loss, as shares of half the slope's
    pull, and of the rope that is left after it, of the whole; how much more of the load fl and rr
    are to carry; how far the front is raised, mm; time in which a lack of pull is made up for, s.
    """

    def __init__(self, plan: Array) -> None:
        super().__init__()
        self._before, self._alone, self._uneven, self._front_mm, lag_s = plan[:2], *plan[2:]
        self._lifted_mm = 0.0
        self.reaction_s = max(float(lag_s), STEP_S)

    def _ready(self, tension: Array) -> Array:
        del tension
        return np.asarray(0.5 * self._before * self._slope_n)

    def _left(self) -> float:
        return float(self._alone) * self._slope_n

    def _raised(self, loads: Array) -> Array:
        step_mm = float(np.clip(self._front_mm - self._lifted_mm, -1.0, 1.0))
        self._lifted_mm += step_mm
        shifted = loads - 0.25 * self._uneven * loads.sum() * DIAGONAL
        return super()._raised(shifted) + 0.5 * step_mm * FRONT


class HolePlan:
    """Five numbers: share of the true best feed, share of the reserve that it is held to, share of
    the hammer, and the actions of both ropes' pulls and of the diagonal.
    """

    def __init__(self, env: Any, plan: Array) -> None:
        self._env, self._plan = env, plan

    def act(self, observation: Vector) -> Vector:
        """See Agent."""
        del observation
        best, held, hammer, pulls, diagonal = self._plan
        feed = min(best * self._env.best_feed_n, max(held, 0.0) * self._env.reserve_n)
        action = action_of(float(feed), float(np.clip(hammer, 0.0, 1.0)))
        action[2:] = np.clip([pulls, pulls, diagonal], -1.0, 1.0)
        return action
