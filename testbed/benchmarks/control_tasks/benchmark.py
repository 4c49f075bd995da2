"""Headroom and who wins it: every entrant and the oracle on the same held-out cases, each case a
drawn machine.
"""

from __future__ import annotations

import atexit
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.control_tasks.oracle import Found, search
from testbed.benchmarks.control_tasks.tasks import TASKS, Entrant, Task, trained
from testbed.benchmarks.harness import Answers, Benchmark
from testbed.envs.agents.base import Agent
from testbed.errors import InputError
from testbed.report.tables import Table

Array = NDArray[np.float64]
ORACLE = "oracle"
SCORING_SEED = 100_000
"""Seed of the first case that is scored; those below are for tuning."""
RESAMPLES = 2000
TOLD = ("verdict", "slip_m", "held", "caught_s", "depth_m", "t_s")
"""What of the last step's `info` is kept."""


@dataclass(frozen=True)
class Case:
    """One entrant on one case; `policy`: its file, where it was trained."""

    task: str
    entrant: str
    seed: int
    policy: str = ""


@dataclass(frozen=True)
class ControlTasks(Benchmark[Case]):
    """`cases` cases of each of `tasks`. Raises InputError for a task that is none."""

    name = "control"
    noun = "episodes"
    beside = ()
    tasks: tuple[str, ...] = tuple(TASKS)
    number: int = 20
    first_seed: int = SCORING_SEED
    oracle_episodes: int = 32
    policies: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in self.tasks:
            if name not in TASKS:
                raise InputError(
                    "no such task", field="--task", value=name, allowed=", ".join(TASKS)
                )

    def cases(self) -> Mapping[str, Case]:
        """Case by case, so that a part of them is a fair sample."""
        made = []
        for task in self.tasks:
            for seed in range(self.first_seed, self.first_seed + self.number):
                made += [Case(task, entrant, seed) for entrant in (*TASKS[task].entrants, ORACLE)]
                made += [Case(task, Path(file).parent.name, seed, file) for file in self.policies]
        return {f"{case.task} {case.seed} {case.entrant}": case for case in made}

    def made_from(self, case: Case) -> str:
        """The case, and the oracle's budget where it is the oracle's."""
        return f"{case!r} {self.oracle_episodes if case.entrant == ORACLE else 0}"

    def work(self, case: Case) -> dict[str, Any]:
        """The episode's score and how it ended; of the oracle its best one."""
        task, told = TASKS[case.task], {"task": case.task, "entrant": case.entrant}
        if case.entrant != ORACLE:
            entrant = (
                trained(Path(case.policy), case.task)
                if case.policy
                else task.entrants[case.entrant]
            )
            return told | {"seed": case.seed} | episode(task, entrant, case.seed)
        if task.solved_by:
            solved = episode(task, task.entrants[task.solved_by], case.seed)
            if solved["held"]:  # leaves the task: nothing is to be searched for
                return told | {"seed": case.seed, "plan": (), "history": ()} | solved
        return told | {"seed": case.seed} | best_found(task, case.seed, self.oracle_episodes)

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """By task: every entrant's mean score with its interval, and the headroom."""
        return {task: summary(task, list(answers.values())) for task in self.tasks}

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """One table a task."""
        made = []
        for task, found in result.items():
            rows = [
                [
                    name,
                    f"{line['mean']:.2f} ({line['low']:.2f} to {line['high']:.2f})",
                    f"{100 * line['stood']:.0f} %",
                    f"{100 * line['held']:.0f} %, {line['caught_s']:.2f} s"
                    if "held" in line
                    else "",
                    f"{100 * line['closed']:.0f} %",
                ]
                for name, line in found["entrants"].items()
            ]
            title = (
                f"{task}: {found['cases']} cases, headroom {100 * found['headroom']:.0f} % over"
                f" {found['best_rule']}; {found['left']} cases left the task, doubling the oracle's budget"
                f" adds {100 * found['doubling']:.1f} %"
            )
            heads = ["who", f"score [{TASKS[task].unit}]", "stood", "held, caught", "closed"]
            made.append(Table(title, heads, rows))
        return made


@lru_cache(maxsize=8)
def _environment(name: str, randomisation: str | None, overrides: tuple[str, ...]) -> Any:
    """An environment of a process, used again and again."""
    from testbed import envs

    own = envs.ENVIRONMENTS[name][1]
    drawn = own["randomisation"] if randomisation is None else randomisation
    changes = [*own.get("overrides", []), *overrides]
    made = envs.make(name, randomisation=drawn, overrides=changes)
    atexit.register(made.close)
    return made


def episode(task: Task, entrant: Entrant, seed: int) -> dict[str, Any]:
    """The return of one episode and how it ended."""
    env = _environment(task.environment, task.randomisation, entrant.overrides)
    observation, _ = env.reset(seed=seed)
    return _played(env, entrant.make(env), observation)


def best_found(task: Task, seed: int, budget: int) -> dict[str, Any]:
    """The oracle's best episode of one case: every plan is tried from the same saved instant."""
    env = _environment(task.environment, task.randomisation, ())
    env.reset(seed=seed)
    start = env.unwrapped.save()
    ends: dict[float, dict[str, Any]] = {}

    def score(plan: Array) -> float:
        observation, _ = env.unwrapped.restore(start)
        end = _played(env.unwrapped, task.plans.agent(env, plan), observation)
        ends.setdefault(end["score"], end)
        return float(end["score"])

    found: Found = search(score, task.plans.starts, task.plans.spread, budget, seed)
    return {"plan": found.plan, "history": found.history} | ends[found.score]


def _played(env: Any, agent: Agent, observation: Any) -> dict[str, Any]:
    """The return of the rest of an episode and how it ended."""
    score, over, info = 0.0, False, {}
    while not over:
        observation, reward, lost, ended, info = env.step(agent.act(observation))
        score, over = score + float(reward), lost or ended
    return {"score": score} | {key: info[key] for key in TOLD if key in info}


def summary(task: str, answers: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Means with bootstrap intervals of 95 %, and the share of the headroom that each has closed.

    Headroom is the oracle's mean less the best tuned rule's, as a share of that rule's. Where an
    entrant does better than the oracle's own plan, the oracle does as that entrant did: `beaten` is
    the share of such cases.
    """
    mine = sorted((answer for answer in answers if answer["task"] == task), key=lambda a: a["seed"])
    solved_by = TASKS[task].solved_by
    solved = {a["seed"] for a in mine if a["entrant"] == solved_by and a["held"]}
    mine = [answer for answer in mine if answer["seed"] not in solved]
    names = list(dict.fromkeys(answer["entrant"] for answer in mine))
    scores = {
        key: np.array([answer["score"] for answer in mine if answer["entrant"] == key])
        for key in names
    }
    others = np.max([values for name, values in scores.items() if name != ORACLE], axis=0)
    beaten = float(np.mean(others > scores[ORACLE]))
    scores[ORACLE] = np.maximum(scores[ORACLE], others)
    ends = {key: [answer for answer in mine if answer["entrant"] == key] for key in names}
    best = max(TASKS[task].rules, key=lambda name: float(scores[name].mean()))
    rule, oracle = float(scores[best].mean()), float(scores[ORACLE].mean())
    rng = np.random.default_rng(0)
    lines = {}
    for name, values in scores.items():
        means = rng.choice(values, (RESAMPLES, len(values))).mean(axis=1)
        low, high = np.quantile(means, [0.025, 0.975])
        closed = (float(values.mean()) - rule) / max(oracle - rule, 1e-9)
        lines[name] = {
            "mean": float(values.mean()),
            "low": float(low),
            "high": float(high),
            **_ends(ends[name]),
            "closed": closed,
        }
    return {
        "cases": len(scores[best]),
        "left": len(solved),
        "doubling": _doubling(ends[ORACLE]),
        "best_rule": best,
        "headroom": (oracle - rule) / max(abs(rule), 1e-9),
        "beaten": beaten,
        "entrants": lines,
    }


def _ends(answers: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Shares of the episodes that stood and that held, and the median time until one was caught."""
    found = {"stood": float(np.mean([answer["verdict"] == "stood" for answer in answers]))}
    if all("held" in answer for answer in answers):
        found["held"] = float(np.mean([answer["held"] for answer in answers]))
        found["caught_s"] = float(np.median([answer["caught_s"] for answer in answers]))
    return found


def _doubling(answers: Sequence[Mapping[str, Any]]) -> float:
    """By which share the oracle's mean score grew in the second half of its search."""
    histories = [answer["history"] for answer in answers if answer["history"]]
    if not histories:
        return 0.0
    half = float(np.mean([history[(len(history) - 1) // 2] for history in histories]))
    return float(np.mean([history[-1] for history in histories])) / max(abs(half), 1e-9) - 1.0
