"""How many steps environments in several processes make against one.

Times are those of a clock on the wall, for that is what workers are for: they are worth something
on a quiet machine alone, with a core for each worker. One worker and several take turns.
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from testbed.benchmarks.speed.bench import DRILL
from testbed.errors import InputError
from testbed.report.page import Table

ROUNDS, SECONDS = 7, 2.5
SETTLING_STEPS = 50
"""Steps before the first round."""
STEPS_MS = (20, 50)
"""Simulated time of an environment's step: a short one, and one of most decisions."""
LONG_S = 3600.0
"""Of an episode, so that no worker begins anew while it is timed."""


def worker_speeds(
    counts: Sequence[int], rounds: int = ROUNDS, seconds: float = SECONDS
) -> list[dict[str, Any]]:
    """Of the environment that drills, per length of a step and count of workers: steps a second of
    all together, `times_one` what that is of one worker's in the same round (medians over rounds),
    and `share` of what as many cores would make. `seconds`: simulated time of a round.

    Raises InputError for less than one worker.
    """
    for count in counts:
        if count < 1:
            raise InputError("too few", field="--workers", value=count, allowed="1 or more")
    kinds = sorted({1, *counts})
    rows = []
    for step_ms in STEPS_MS:
        rows += _of_steps(step_ms, kinds, rounds, round(1e3 * seconds / step_ms))
    return rows


def _of_steps(step_ms: int, kinds: Sequence[int], rounds: int, steps: int) -> list[dict[str, Any]]:
    teams = {count: _Team(count, step_ms) for count in kinds}
    try:
        rates: dict[int, list[float]] = {count: [] for count in kinds}
        for _ in range(rounds):
            for count, team in teams.items():
                rates[count].append(team.steps_per_s(steps))
    finally:
        for team in teams.values():
            team.close()
    return [{"step_ms": step_ms} | _row(count, rates[count], rates[1]) for count in kinds]


def workers_table(found: Sequence[dict[str, Any]]) -> Table:
    """A count of workers a row."""
    rows = [[f"{value:.3g}" for value in row.values()] for row in found]
    return Table("Speed of several workers", list(found[0]), rows)


def _row(count: int, rates: Sequence[float], alone: Sequence[float]) -> dict[str, Any]:
    times = statistics.median(rate / one for rate, one in zip(rates, alone, strict=True))
    return {
        "workers": count,
        "cores": os.cpu_count(),
        "env_steps_per_s": statistics.median(rates),
        "times_one": times,
        "share": times / count,
    }


class _Team:
    """So many environments, each in a process of its own, that hold still."""

    def __init__(self, count: int, step_ms: int) -> None:
        from testbed import envs

        self._envs = envs.make_in_processes(DRILL, count, duration_s=LONG_S, step_ms=step_ms)
        self._still = np.zeros(self._envs.action_space.shape or (count,), dtype=np.float32)
        self._count = count
        self._envs.reset(seed=0)
        self.steps_per_s(SETTLING_STEPS)

    def steps_per_s(self, steps: int) -> float:
        """Of all workers together, over so many steps of each."""
        start = time.perf_counter()
        for _ in range(steps):
            self._envs.step(self._still)
        return self._count * steps / (time.perf_counter() - start)

    def close(self) -> None:
        """End the processes."""
        self._envs.close()
