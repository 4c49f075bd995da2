"""Runs of the shipped scenarios, made by a process of its own beside the other tests."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from testbed.scenario.scenario import load_scenario
from testbed.simulation.run import run_scenario

Job = tuple[str, bool]
"""A scenario's name and whether it runs under its mutation."""


class Runs:
    """What each run finds unmet of its scenario's expectation; a run that is not begun when asked
    for is made then.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._begun: dict[Job, Future[list[str]]] = {}

    def begin(self, pool: ProcessPoolExecutor, jobs: Iterable[Job]) -> None:
        """Hand runs to a pool, the longest first."""
        for job in sorted(jobs, key=_length):
            self._begun[job] = pool.submit(_unmet, self._folder, job)

    def unmet(self, name: str, mutated: bool) -> list[str]:
        """Waits for the run, or makes it."""
        begun = self._begun.get((name, mutated))
        return (
            _unmet(self._folder, (name, mutated))
            if begun is None or begun.cancel()
            else begun.result()
        )


@contextmanager
def made_beside(jobs: set[Job], folder: Path) -> Iterator[Runs]:
    """The runs of `jobs`, by another process while the tests go on; without it where it would not
    pay.
    """
    runs = Runs(folder)
    if len(jobs) < 3 or len(os.sched_getaffinity(0)) < 2 or "PYTEST_XDIST_WORKER" in os.environ:
        yield runs
        return
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        pool.submit(_compile).result()
        runs.begin(pool, jobs)
        yield runs
        pool.shutdown(cancel_futures=True)


def _compile() -> None:
    """Fill the cache of kernels once, not in every process."""
    from testbed.world.simulation import Simulation

    Simulation(load_scenario("stand_flat", duration=1.0)).close()


def _unmet(folder: Path, job: Job) -> list[str]:
    name, mutated = job
    mutation = load_scenario(name).mutation
    changes = mutation.overrides() if mutated and mutation is not None else []
    summary: dict[str, Any] = run_scenario(
        load_scenario(name, changes), folder / f"{name}{'-mutated' if mutated else ''}"
    ).summary
    return list(summary["expectations"]["unmet"])


def _length(job: Job) -> float:
    return -load_scenario(job[0]).duration_s
