"""The oracle: knows the truth and the future of its case, and searches its plan on that very case.

The search is the cross-entropy method: draw plans around the best so far, keep the best quarter, narrow down. Its budget
is a number of episodes, which the result states.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.envs.agents.base import Readings, Vector
from testbed.envs.agents.drill_hole import action_of
from testbed.envs.agents.keep import MOST_N, ROPE_N_M, STEP_S
from testbed.envs.keep import HAUL_M_S, RAISE_M
from testbed.envs.observations import KEEP_TABLE
from testbed.machine.names import LEGS, SIDES

Array = NDArray[np.float64]
POPULATION, KEPT = 8, 2
"""Plans drawn a round, and how many of them the next round is drawn around."""
LEAST_SPREAD = 0.1
"""A spread never falls below this share of the first one."""


@dataclass(frozen=True)
class Found:
    """What a search has found: the best plan, its score, and the best score after so many episodes."""

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
    """The best of `budget` plans by `score`: those of `starts` first, then rounds drawn around the best."""
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


class KeepPlan:
    """Eight numbers: pull of the left and right rope as shares of half the slope's pull, of the diagonal and of the
    front's set points in mm, before the fault; the same four after it, of each rope that is left by the whole pull.
    """

    def __init__(self, fault_s: float, plan: Array) -> None:
        self._fault_s, self._before, self._after = fault_s, plan[:4], plan[4:]
        self._t_s = 0.0
        self._slope_n = 0.0
        self._first: Array | None = None
        self._raised = np.zeros(len(LEGS))

    def act(self, observation: Vector) -> Vector:
        """See Agent."""
        seen = Readings(observation, KEEP_TABLE)
        tension = seen.each("rope_tension", SIDES)
        if self._first is None:
            self._first = tension
            loads = seen.each("estimate_own", LEGS).sum()
            self._slope_n = float(loads * np.tan(-seen["attitude_pitch"]))
        self._t_s += STEP_S
        late = self._t_s + STEP_S > self._fault_s
        now = self._after if late else self._before
        latest = self._first + seen.each("control.pull_change", SIDES)
        slack = latest < 0.25 * self._first
        share = np.where(slack[::-1], 1.0, 0.5) if late else np.full(len(SIDES), 0.5)
        wanted = np.minimum(now[:2] * share * self._slope_n, MOST_N)
        speeds = np.where(slack, 0.0, (wanted - latest) / ROPE_N_M / STEP_S)
        raised = 1e-3 * (
            now[2] * np.array([1.0, -1.0, -1.0, 1.0]) + now[3] * np.array([1.0, 1.0, -1.0, -1.0])
        )
        lifts = np.clip((raised - self._raised) / RAISE_M, -1.0, 1.0)
        self._raised = self._raised + RAISE_M * lifts
        return np.clip(np.concatenate([speeds / HAUL_M_S, lifts]), -1.0, 1.0).astype(np.float32)


class HolePlan:
    """Five numbers: share of the true best feed, share of the reserve that it is held to, share of the hammer, and the
    actions of both ropes' pulls and of the diagonal.
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
