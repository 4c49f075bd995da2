"""Headroom and who wins it: every entrant and the oracle on the same held-out cases, each case a
drawn machine.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.control_tasks.episodes import best_found, episode
from testbed.benchmarks.control_tasks.tasks import TASKS, Entrant, trained
from testbed.benchmarks.harness import Answers, Benchmark
from testbed.errors import check_one_of
from testbed.formats.arrays import Array
from testbed.report.page import Table

Scores = Mapping[int, float]
"""By the case's seed."""
ORACLE = "oracle"
SCORING_SEED = 100_000
"""Seed of the first case that is scored; those below are for tuning."""
RESAMPLES = 2000


@dataclass(frozen=True)
class Case:
    """One drawn machine, for all who try the task and the oracle."""

    task: str
    seed: int


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
            check_one_of(name, TASKS, "--task", "no such task")

    def cases(self) -> Mapping[str, Case]:
        """Case by case, so that a part of them is a fair sample."""
        seeds = range(self.first_seed, self.first_seed + self.number)
        made = [Case(task, seed) for task in self.tasks for seed in seeds]
        return {f"{case.task} {case.seed}": case for case in made}

    def made_from(self, case: Case) -> str:
        """The case, who tries it beside the task's own entrants, and the oracle's budget."""
        return f"{case!r} {self.policies} {self.oracle_episodes}"

    def work(self, case: Case) -> list[dict[str, Any]]:
        """Every entrant's score and how its episode ended; of the oracle its best one.

        A case that the task's simple rule solves leaves the task: nobody else tries it.
        """
        task = TASKS[case.task]
        entrants = {**task.entrants, **self._learned(case.task)}
        answers = []
        for name in sorted(entrants, key=lambda name: name != task.solved_by):
            if case.seed % entrants[name].each:
                continue
            end = episode(task, entrants[name], case.seed)
            answers.append(self._row(case, name, end))
            if name == task.solved_by and end["held"]:
                return answers
        best = best_found(task, case.seed, self.oracle_episodes, answers)
        return [*answers, self._row(case, ORACLE, best)]

    def _learned(self, task: str) -> dict[str, Entrant]:
        """The policies, each called as its folder."""
        return {Path(file).parent.name: trained(Path(file), task) for file in self.policies}

    @staticmethod
    def _row(case: Case, entrant: str, end: Mapping[str, Any]) -> dict[str, Any]:
        return {"task": case.task, "entrant": entrant, "seed": case.seed, **end}

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """By task: every entrant's mean score with its interval, and the headroom."""
        rows = list(chain.from_iterable(answers.values()))
        return {task: summary(task, rows) for task in self.tasks}

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """One table a task."""
        made = []
        for task, found in result.items():
            rows = [
                [
                    name,
                    f"{line['cases']}",
                    f"{line['mean']:.2f} ({line['low']:.2f} to {line['high']:.2f})",
                    f"{100 * line['held']:.0f} %" if "held" in line else "",
                    f"{line['caught_s']:.2f} s" if line.get("caught_s") is not None else "",
                    f"{100 * line['closed']:.0f} %"
                    f" ({100 * line['closed_low']:.0f} to {100 * line['closed_high']:.0f})",
                ]
                for name, line in found["entrants"].items()
            ]
            title = (
                f"{task}: {found['cases']} cases, headroom {100 * found['headroom']:.0f} % over"
                f" {found['best_rule']}; {found['left']} cases left the task, doubling the oracle's budget"
                f" adds {100 * found['doubling']:.1f} %"
            )
            heads = ["who", "cases", f"score [{TASKS[task].unit}]", "held", "caught", "closed"]
            made.append(Table(title, heads, rows))
        return made


def summary(task: str, answers: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Means with bootstrap intervals of 95 %, and the share of the headroom that each has closed.

    Headroom is the oracle's mean less the best tuned rule's, as a share of that rule's. Where an
    entrant did better than the oracle's first search, that began again at what the entrant did:
    `restarted` is the share of such cases. Where one still does better the oracle does as it did:
    `beaten` is the share of these. An entrant that tried a part of the cases is measured against
    the rule and the oracle on that part.
    """
    mine = sorted((answer for answer in answers if answer["task"] == task), key=lambda a: a["seed"])
    solved_by = TASKS[task].solved_by
    solved = {a["seed"] for a in mine if a["entrant"] == solved_by and a["held"]}
    mine = [answer for answer in mine if answer["seed"] not in solved]
    ends = {
        name: [answer for answer in mine if answer["entrant"] == name]
        for name in dict.fromkeys(answer["entrant"] for answer in mine)
    }
    scores = {name: {a["seed"]: a["score"] for a in rows} for name, rows in ends.items()}
    own = scores[ORACLE]
    oracle = {seed: max(found.get(seed, -math.inf) for found in scores.values()) for seed in own}
    beaten = sum(oracle[seed] > score for seed, score in own.items())
    scores[ORACLE] = oracle
    best = max(TASKS[task].rules, key=lambda name: _mean(scores[name]))
    rule, most = _mean(scores[best]), _mean(oracle)
    lines = {
        name: {**_line(found, scores[best], oracle), **_ends(ends[name])}
        for name, found in scores.items()
    }
    return {
        "cases": len(oracle),
        "left": len(solved),
        "doubling": _doubling(ends[ORACLE]),
        "best_rule": best,
        "headroom": (most - rule) / max(abs(rule), 1e-9),
        "restarted": float(np.mean([a.get("restarted", False) for a in ends[ORACLE]])),
        "beaten": beaten / len(oracle),
        "entrants": lines,
    }


def _line(found: Scores, rule: Scores, oracle: Scores) -> dict[str, Any]:
    """An entrant's mean score on its cases, the share of the headroom there that it closes, and
    their intervals.
    """
    values = np.array([[scores[seed] for seed in found] for scores in (found, rule, oracle)])
    drawn = np.random.default_rng(0).integers(len(found), size=(RESAMPLES, len(found)))
    means, again = values.mean(axis=1), values[:, drawn].mean(axis=2)
    (low, high), (closed_low, closed_high) = _interval(again[0]), _interval(_closed(again))
    return {
        "cases": len(found),
        "mean": float(means[0]),
        "low": low,
        "high": high,
        "closed": float(_closed(means)),
        "closed_low": closed_low,
        "closed_high": closed_high,
    }


def _mean(found: Scores) -> float:
    return float(np.mean(list(found.values())))


def _closed(means: Array) -> Array:
    """Share of the headroom that mean scores (3, ..) close: an entrant's, the rule's, the
    oracle's.
    """
    entrant, rule, oracle = means
    return np.asarray((entrant - rule) / np.maximum(oracle - rule, 1e-9))


def _interval(found: Array) -> tuple[float, float]:
    low, high = np.quantile(found, [0.025, 0.975])
    return float(low), float(high)


def _ends(answers: Sequence[Mapping[str, Any]]) -> dict[str, float | None]:
    """Share of the episodes that held, and the median time until one of these was caught."""
    if not all("held" in answer for answer in answers):
        return {}
    held = [answer for answer in answers if answer["held"]]
    caught = [answer["caught_s"] for answer in held]
    return {
        "held": len(held) / len(answers),
        "caught_s": float(np.median(caught)) if caught else None,
    }


def _doubling(answers: Sequence[Mapping[str, Any]]) -> float:
    """By which share the oracle's mean score grew in the second half of its search."""
    histories = [answer["history"] for answer in answers if answer["history"]]
    if not histories:
        return 0.0
    half = float(np.mean([history[(len(history) - 1) // 2] for history in histories]))
    return float(np.mean([history[-1] for history in histories])) / max(abs(half), 1e-9) - 1.0
