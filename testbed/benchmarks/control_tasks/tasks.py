"""The tasks and who tries them: environments, agents by name, the oracle's plans."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol, Self

from testbed.benchmarks.control_tasks.agents import (
    Agent,
    Constant,
    Hauling,
    Secure,
    Trained,
    Vector,
    Yielding,
)
from testbed.benchmarks.control_tasks.climbing import ClimbPlan, no_plan
from testbed.benchmarks.control_tasks.corrected import FEATURES, OVER, REACH, Corrected
from testbed.benchmarks.control_tasks.drilling import Adaptive, Drill, Reserve, action_of
from testbed.benchmarks.control_tasks.oracle import KeepPlan, keep_plan_of
from testbed.envs import named
from testbed.envs.drill_hole import HANDBOOK
from testbed.envs.policies import read_policy
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.networks import read_network

QP = ("control.distribution=qp",)
SELDOM = 5
BRISK = ("task.gait=brisk",)
AS_IT_IS = (0.0, 0.0, 0.0)
"""Decisions of Climb-v1 that leave the gait as it is."""
TUNED_STRIDE = (0.3, -0.5, 0.5)
"""Decisions that paid best of six under the flowing crawl on four tuning cases."""
BRISK_STRIDE = (0.5, -0.5, 0.3)
"""Decisions that paid best of five under the brisk crawl, on such cases."""
MakeAgent = Callable[[Any], Agent]
"""From an environment that was reset, for one episode."""


@dataclass(frozen=True)
class Entrant:
    """Somebody who tries a task."""

    make: MakeAgent
    overrides: tuple[str, ...] = ()
    """Changes of the scenario: another controller underneath."""
    each: int = 1
    """Tries the cases whose seed this divides: what is far from winning need not try them all."""


class PlannedAgent(Agent, Protocol):
    """Carries out a plan."""

    def with_plan(self, plan: Array) -> Self:
        """The same agent, at the instant where it is, with another plan for what comes."""
        ...


@dataclass(frozen=True)
class Plans:
    """What the oracle chooses among, case by case: plans as vectors, and the agent that carries one
    out.
    """

    agent: Callable[[Any, Array], PlannedAgent]
    starts: tuple[tuple[float, ...], ...]
    """Plans that are tried first; the search begins at the best of them."""
    spread: tuple[float, ...]
    """Standard deviations with which the search begins."""
    done_in: Callable[[Sequence[Vector]], tuple[float, ...]]
    """The plan that comes closest to what was done in an episode, from the observations of its
    steps; empty where there is none.
    """
    alike: int = 0
    """So many first numbers of a plan are all that matters until the environment's `fault_s`."""
    overrides: tuple[str, ...] = ()
    """Changes of the scenario for the oracle: the controller underneath."""


@dataclass(frozen=True)
class Task:
    """A task: its environment's name, who tries it, and the oracle's plans. The entrant `rule`
    names the tuned one.
    """

    environment: str
    unit: str
    """Of the score: the return of an episode."""
    entrants: Mapping[str, Entrant]
    rules: tuple[str, ...]
    """Entrants that are tuned rules: headroom is the oracle's mean less the best of theirs."""
    plans: Plans | None
    """None: the environment says the most that anybody could be paid (`most_paid`), and that is the
    oracle's.
    """
    overrides: tuple[str, ...] = ()
    """Changes of the scenario for all who try it."""
    randomisation: str | None = None
    """Set that the cases are drawn from; None: the environment's own."""
    solved_by: str = ""
    """Entrant whose held cases leave the task: there is nothing to win in them."""


def _keep_plan(env: Any, plan: Array) -> PlannedAgent:
    """Was tried out on this very case: see KeepPlan."""
    del env
    return KeepPlan(plan)


def _climb_plan(env: Any, plan: Array) -> PlannedAgent:
    """Was tried out on this very case: see ClimbPlan."""
    del env
    return ClimbPlan(plan)


TASKS: dict[str, Task] = {
    "keep": Task(
        "Roboclimber/Keep-v0",
        "s held",
        {
            "nothing": Entrant(lambda env: Constant([0.0] * 5), each=SELDOM),
            "leaning on the limits": Entrant(
                lambda env: Constant([1.0, 1.0, 0.0, 0.0, -1.0]), each=SELDOM
            ),
            "quadratic program": Entrant(lambda env: Constant([0.0] * 5), QP, SELDOM),
            "hauling rule": Entrant(lambda env: Hauling()),
            "secure pull": Entrant(lambda env: Secure()),
            "yielding legs": Entrant(lambda env: Yielding()),
        },
        ("hauling rule", "secure pull"),
        Plans(
            _keep_plan,
            (
                (1.25, 1.0, 0.05, 3.0, 2.0, 20.0, 30.0, 30.0),
                (1.25, 1.0, 0.05, 3.0, 2.0, 10.0, 15.0, 15.0),
                (1.15, 1.0, 0.05, 6.0, 4.0, 20.0, 30.0, 30.0),
                (1.15, 1.0, 0.05, 1.5, 2.0, 20.0, 40.0, 50.0),
            ),
            (0.07, 0.15, 0.05, 3.0, 3.0, 8.0, 12.0, 15.0),
            keep_plan_of,
            alike=1,
        ),
        solved_by="hauling rule",
    ),
    "drill-hole": Task(
        "Roboclimber/DrillHole-v0",
        "cm, less the price of lost and slipped feet",
        {
            "nothing": Entrant(lambda env: Constant(action_of(0.0, 0.0)), each=SELDOM),
            "handbook": Entrant(lambda env: Constant(HANDBOOK), each=SELDOM),
            "tuned feed": Entrant(lambda env: Reserve(Drill.of(env), 4500.0, 0.5)),
            "tuned feed and pull": Entrant(lambda env: Reserve(Drill.of(env), 4500.0, 0.5, 0.25)),
            "adaptive": Entrant(lambda env: Adaptive(Drill.of(env)), each=SELDOM),
        },
        ("tuned feed", "tuned feed and pull"),
        None,
        ("duration_s=30",),
    ),
    "climb": Task(
        "Roboclimber/Climb-v1",
        "the environment's pay: metres less time, energy and feet lost or slipped",
        {
            "two-phase crawl": Entrant(lambda env: Constant(AS_IT_IS), ("task.gait=two_phase",)),
            "flowing crawl": Entrant(lambda env: Constant(AS_IT_IS)),
            "quadratic program": Entrant(lambda env: Constant(AS_IT_IS), QP, SELDOM),
            "leaning on the limits": Entrant(lambda env: Constant([1.0] * 3), each=SELDOM),
            "tuned stride": Entrant(lambda env: Constant(TUNED_STRIDE)),
            "brisk crawl": Entrant(lambda env: Constant(AS_IT_IS), BRISK),
            "brisk crawl, tuned stride": Entrant(lambda env: Constant(BRISK_STRIDE), BRISK),
        },
        ("flowing crawl", "tuned stride"),
        Plans(
            _climb_plan,
            ((*AS_IT_IS, *AS_IT_IS), (*BRISK_STRIDE, *BRISK_STRIDE)),
            (0.3, 0.4, 0.4, 0.3, 0.4, 0.4),
            no_plan,
            overrides=BRISK,
        ),
    ),
}

TASKS["keep-undeclared"] = replace(TASKS["keep"], randomisation="keep_undeclared")
"""The same cases, each with an effect of the world that the model lacks."""


def trained(policy: Path, task: str) -> Entrant:
    """A policy of `testbed train` as an entrant. Raises InputError for one of another task."""
    name, network = read_policy(policy)
    wanted = named(TASKS[task].environment)
    if named(name) != wanted:
        raise InputError("is of another task", file=policy, field="task", value=name, allowed=task)
    over = read_network(policy)[1].get("over") if policy.suffix == ".npz" else None
    if over is None:
        return Entrant(lambda env: Trained(network))
    if over != OVER or (network.inputs, network.outputs) != (len(FEATURES), len(REACH)):
        raise InputError("corrects no rule", file=policy, field="over", value=over, allowed=OVER)
    return Entrant(lambda env: Corrected(network))
