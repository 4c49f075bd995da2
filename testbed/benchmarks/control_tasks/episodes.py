"""Episodes of a case: every entrant begins at the same saved instant, and plans part where they
differ.
"""

from __future__ import annotations

import atexit
import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

from testbed.benchmarks.control_tasks.agents import Agent, Vector
from testbed.benchmarks.control_tasks.oracle import Found, search
from testbed.benchmarks.control_tasks.tasks import Entrant, PlannedAgent, Plans, Task
from testbed.formats.arrays import Array

DECIDED = 1e-9
"""An episode is given up where no more than this is left to be paid."""
TOLD = ("verdict", "slip_m", "held", "caught_s", "depth_m", "way_m", "work_j", "t_s")
"""What of the last step's `info` is kept."""


class Stage:
    """An environment of a process, used again and again; the case that it began last is kept."""

    def __init__(self, env: Any) -> None:
        self.env = env
        self._seed: int | None = None
        self._start: Any = None

    def begin(self, seed: int) -> Any:
        """Go to the beginning of a case; returns the observation and `info` there."""
        if seed != self._seed:
            self.env.reset(seed=seed)
            self._seed, self._start = seed, self.env.save()
        return self.env.restore(self._start)

    def play(
        self, agent: Agent, seen: Any, until_s: float = math.inf, floor: float = -math.inf
    ) -> tuple[float, Any]:
        """Let an agent act on `seen` (observation, info) to the end, or to the last decision before
        `until_s`: the return, and what is seen then.

        Given up where not even the best rest of an episode brings the return to `floor`; what is
        returned is then the most that it could have been.
        """
        score, (observation, info) = 0.0, seen
        while self.env.next_s < until_s:
            observation, reward, *_, info = self.env.step(agent.act(observation))
            score += float(reward)
            left = self.env.most_left
            if left < DECIDED or score + left < floor:
                return score + left, (observation, info)
        return score, (observation, info)


def stage(task: Task, overrides: tuple[str, ...] = ()) -> Stage:
    """The stage of a task in this process."""
    return _stage(task.environment, task.randomisation, (*task.overrides, *overrides))


@lru_cache(maxsize=8)
def _stage(environment: str, randomisation: str | None, overrides: tuple[str, ...]) -> Stage:
    from testbed import envs

    own = envs.ENVIRONMENTS[environment][1]
    drawn = own["randomisation"] if randomisation is None else randomisation
    changes = [*own.get("overrides", []), *overrides]
    made = envs.make(environment, randomisation=drawn, overrides=changes).unwrapped
    atexit.register(made.close)
    return Stage(made)


class Watched:
    """Acts as another agent does and keeps what that one observed."""

    def __init__(self, agent: Agent) -> None:
        self._agent = agent
        self.observations: list[Vector] = []

    def act(self, observation: Vector) -> Vector:
        """See Agent."""
        self.observations.append(observation)
        return self._agent.act(observation)


def episode(task: Task, entrant: Entrant, seed: int) -> dict[str, Any]:
    """The return of one episode, how it ended, and as `plan` the oracle's plan that comes closest
    to what was done in it; no plan where the task has none, or where nothing happened.
    """
    place = stage(task, entrant.overrides)
    seen = place.begin(seed)
    agent = Watched(entrant.make(place.env))
    end = _end(*place.play(agent, seen))
    return end | {"plan": task.plans.done_in(agent.observations) if task.plans else ()}


class Branches:
    """Plans tried on one case. Those with the same first numbers go the same way until they part,
    which is simulated once.
    """

    def __init__(self, task: Task, plans: Plans, seed: int) -> None:
        self._plans, self._seed = plans, seed
        self._stage = stage(task, plans.overrides)
        self._begun: tuple[float, ...] | None = None
        self._parting: tuple[float, PlannedAgent, Any] | None = None
        """Return so far, agent, and the saved episode."""
        self.ends: dict[float, dict[str, Any]] = {}
        """How episodes of these returns ended."""

    def score(self, plan: Array, floor: float) -> float:
        """See oracle.Score."""
        paid, agent, saved = self._part(plan)
        seen = self._stage.env.restore(saved)
        further, seen = self._stage.play(agent.with_plan(plan), seen, floor=floor - paid)
        self.ends.setdefault(paid + further, _end(paid + further, seen))
        return paid + further

    def _part(self, plan: Array) -> tuple[float, PlannedAgent, Any]:
        """Where plans with these first numbers part."""
        begun = tuple(plan[: self._plans.alike].tolist())
        if self._parting is None or begun != self._begun:
            seen, env = self._stage.begin(self._seed), self._stage.env
            agent, paid = self._plans.agent(env, plan), 0.0
            if begun:
                paid, _ = self._stage.play(agent, seen, until_s=env.fault_s)
            self._begun, self._parting = begun, (paid, agent, env.save())
        return self._parting


def best_found(
    task: Task, seed: int, budget: int, others: Sequence[Mapping[str, Any]] = ()
) -> dict[str, Any]:
    """The oracle's best episode of one case; of a task without plans the most that it could pay.

    Where one of the other entrants' episodes (see `episode`) scored more, the search begins again
    with the same budget at what that entrant did.
    """
    plans = task.plans
    if plans is None:
        place = stage(task)
        place.begin(seed)
        return {"plan": (), "history": (), "score": place.env.most_paid()}
    branches = Branches(task, plans, seed)

    def searched(starts: tuple[tuple[float, ...], ...]) -> Found:
        return search(branches.score, starts, plans.spread, budget, seed, plans.alike)

    found = searched(plans.starts)
    better = [other for other in others if other["score"] > found.score and other["plan"]]
    if better:
        best = max(better, key=lambda other: float(other["score"]))
        again = searched((best["plan"], found.plan))
        found = max(found, again, key=lambda one: one.score)
    restarted = {"restarted": bool(better)}
    return {"plan": found.plan, "history": found.history} | restarted | branches.ends[found.score]


def _end(score: float, seen: tuple[Any, dict[str, Any]]) -> dict[str, Any]:
    return {"score": score} | {key: seen[1][key] for key in TOLD if key in seen[1]}
