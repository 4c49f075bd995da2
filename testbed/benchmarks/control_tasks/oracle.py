"""The oracle: knows the truth and the future of its case, and searches its plan on that very case.

The search is the cross-entropy method: draw plans around the best so far, keep the best quarter,
narrow down. Its budget is a number of plans, which the result states. The plans of a round begin
alike: what happens until they part is simulated once, and a plan that can no longer come among the
best is given up.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from testbed.benchmarks.control_tasks.agents import (
    SLACK_SHARE,
    STEP_S,
    Readings,
    Secure,
    Vector,
    slope_pull,
)
from testbed.envs.observations import KEEP_TABLE
from testbed.formats.arrays import Array, Flags
from testbed.machine.names import SIDES

POPULATION, KEPT = 8, 2
"""Plans drawn a round, and how many of them the next round is drawn around."""
SHIFT_S = (0.0, 0.1, 0.2, 0.4)
"""Times after a loss between which a plan's shift moves steadily."""
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


Score = Callable[[Array, float], float]
"""Score of a plan; of one that cannot reach the second number any more, anything below that."""


def search(
    score: Score,
    starts: tuple[tuple[float, ...], ...],
    spread: tuple[float, ...],
    budget: int,
    seed: int,
    alike: int = 0,
) -> Found:
    """The best of `budget` plans by `score`: those of `starts` first, then rounds drawn around the
    best, whose plans have their first `alike` numbers in common.
    """
    rng = np.random.default_rng([seed, 5])
    tried: list[tuple[float, tuple[float, ...]]] = []
    history: list[float] = []

    def attempt(plan: tuple[float, ...]) -> None:
        best = sorted((found for found, _ in tried), reverse=True)
        floor = best[KEPT - 1] if len(best) >= KEPT else -math.inf
        tried.append((score(np.array(plan), floor), plan))
        history.append(max(found for found, _ in tried))

    for start in starts[:budget]:
        attempt(start)
    wide = np.array(spread)
    while len(history) < budget:
        best = [np.array(plan) for _, plan in sorted(tried, reverse=True)[:KEPT]]
        begun = best[0] + wide * rng.standard_normal(len(wide))
        for _ in range(min(POPULATION, budget - len(history))):
            centre = best[int(rng.integers(len(best)))]
            plan = centre + wide * rng.standard_normal(len(wide))
            plan[:alike] = begun[:alike]
            attempt(tuple(plan.tolist()))
        wide = np.maximum(0.7 * wide, LEAST_SPREAD * np.array(spread))
    top, plan_found = max(tried)
    return Found(plan_found, top, tuple(history))


class KeepPlan(Secure):
    """Eight numbers: pull of both ropes before a loss over the slope's, alike, as nobody can know
    which one will part; then pull of what is left over the slope's, time in which a lack of pull is
    made up for, s; how far the diagonal towards the lost rope and the front are raised, mm; how far
    the body has gone down the slope at the last three of SHIFT_S, mm.
    """

    def __init__(self, plan: Array) -> None:
        super().__init__()
        self._before = float(plan[0])
        self._side, self._since_s = 0.0, 0.0
        self._follow(plan)

    def with_plan(self, plan: Array) -> Self:
        """The same agent, at the instant where it is, with another plan for what comes."""
        other = copy.copy(self)
        other.reaction_s = max(float(plan[2]), STEP_S)
        other._follow(plan)
        return other

    def _follow(self, plan: Array) -> None:
        self._alone = float(plan[1])
        self._raise_m = 1e-3 * plan[3:5]
        self._down_m = 1e-3 * np.array([0.0, *plan[5:]])

    def _ready(self, seen: Readings, tension: Array) -> Array:
        del seen
        return np.full(len(tension), 0.5 * self._before * self._slope_n)

    def _left_n(self, seen: Readings, pull: Array) -> float:
        del seen, pull
        return self._alone * self._slope_n

    def _raised_m_s(self, seen: Readings, holds: Flags) -> tuple[float, float]:
        now = np.array([seen["orders.diagonal"], seen["orders.front"]])
        if holds.all() and self._stood_m is None:
            return super()._raised_m_s(seen, holds)
        if self._stood_m is None:
            self._stood_m, self._side = now, 1.0 if holds[1] else -1.0
        wanted = self._stood_m + self._raise_m * np.array([self._side, 1.0])
        diagonal, front = ((wanted - now) / STEP_S).tolist()
        return diagonal, front

    def _shifted_m_s(self, seen: Readings, pull: Array) -> float:
        if self._stood_m is None:
            return 0.0
        self._since_s += STEP_S
        wanted = -float(np.interp(self._since_s, SHIFT_S, self._down_m))
        return (wanted - seen["orders.shift"]) / STEP_S


def keep_plan_of(observations: Sequence[Vector]) -> tuple[float, ...]:
    """The plan (see KeepPlan) that comes closest to what another agent did in an episode of Keep,
    from the flat observations of its steps; empty where both ropes held to the end.
    """
    steps = [Readings(observation, KEEP_TABLE) for observation in observations]
    first = steps[0].each("rope_tension", SIDES)
    pulls = np.array([first + seen.each("control.pull_change", SIDES) for seen in steps])
    holds = pulls > SLACK_SHARE * first
    lost = np.flatnonzero(~holds.all(axis=1))
    slope_n, loss = slope_pull(steps[0]), int(lost[0]) if len(lost) else 0
    if loss == 0 or slope_n <= 0.0:
        return ()
    times = STEP_S * np.arange(len(steps) - loss)
    orders = {
        name: np.array([seen[f"orders.{name}"] for seen in steps[loss:]])
        for name in ("diagonal", "front", "shift")
    }
    side = 1.0 if holds[loss, 1] else -1.0
    down = -np.interp(SHIFT_S[1:], times, orders["shift"])
    return (
        float(pulls[loss - 1].sum()) / slope_n,
        float(pulls[loss:].max()) / slope_n,
        STEP_S,
        1e3 * side * float(orders["diagonal"][-1] - orders["diagonal"][0]),
        1e3 * float(orders["front"][-1] - orders["front"][0]),
        *(1e3 * down).tolist(),
    )
