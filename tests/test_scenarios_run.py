"""Every shipped scenario ends as it expects to, and does not under its mutation.

All runs are made by two processes at once, those of the tests that are asked for; each test waits for its own.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from testbed import resources
from testbed.evaluation.run import run_scenario
from testbed.parameters.scenario import load_scenario

NAMES = sorted(p.stem for p in resources.folder("scenarios").glob("*.yaml"))
Job = tuple[str, bool]


def _summary(folder: Path, name: str, *changes: str) -> dict[str, Any]:
    return run_scenario(load_scenario(name, changes), folder / name).summary


def _run(folder: Path, job: Job) -> list[str]:
    """What the scenario's expectation finds unmet, with its mutation if the job says so."""
    name, mutated = job
    mutation = load_scenario(name).mutation
    changes = mutation.overrides() if mutated and mutation is not None else []
    summary = run_scenario(load_scenario(name, changes), folder / f"{name}{'-mutated' if mutated else ''}").summary
    return list(summary["expectations"]["unmet"])


def _length(job: Job) -> float:
    return -load_scenario(job[0]).duration_s


@pytest.fixture(scope="module")
def runs(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[Job, Future[Any]]]:
    """The futures of every run that a test of this module waits for; the longest are begun first."""
    folder = tmp_path_factory.mktemp("runs")
    asked = [item.callspec.params for item in request.session.items if hasattr(item, "callspec")]
    jobs: set[Job] = {(p["name"], p["mutated"]) for p in asked if {"name", "mutated"} <= set(p)}
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(2, os.cpu_count() or 1), mp_context=context) as pool:
        yield {job: pool.submit(_run, folder, job) for job in sorted(jobs, key=_length)}
        pool.shutdown(cancel_futures=True)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("mutated", [False])
def test_it_ends_as_expected(runs: dict[Job, Future[Any]], name: str, mutated: bool) -> None:
    assert runs[name, mutated].result() == []


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("mutated", [True])
def test_its_expectation_fails_under_its_mutation(runs: dict[Job, Future[Any]], name: str, mutated: bool) -> None:
    assert runs[name, mutated].result() != []


def test_every_scenario_has_an_expectation_and_a_mutation_that_can_be_read() -> None:
    for name in NAMES:
        scenario = load_scenario(name)
        assert scenario.expect.verdict or scenario.expect.summary, name
        assert scenario.mutation is not None, name
        changed = load_scenario(name, scenario.mutation.overrides())
        assert changed.expect == scenario.expect, f"{name}: a mutation changes the world, not what is expected of it"


@pytest.mark.slow
def test_without_the_hidden_gain_error_no_leg_stands_out(tmp_path: Path) -> None:
    summary = _summary(tmp_path, "stand_undeclared_gain", "undeclared=[]", "task.kind=stand", "duration_s=10")
    assert summary["residuals"]["stands_out"] is None
    assert summary["expectations"]["met"] is False


@pytest.mark.slow
@pytest.mark.parametrize("leg", ["fr", "rl", "rr"])
def test_the_leg_with_the_wrong_gain_stands_out_wherever_it_is(tmp_path: Path, leg: str) -> None:
    changes = (f"undeclared.0.at={leg}_vertical", "task.kind=stand", "duration_s=5")
    summary = _summary(tmp_path, "stand_undeclared_gain", *changes)
    assert summary["residuals"]["stands_out"]["leg"] == leg


@pytest.mark.slow
def test_without_ropes_the_robot_slides_down_a_steep_slope(tmp_path: Path) -> None:
    summary = _summary(tmp_path, "stand_slope_45", "ropes.enabled=false", "terrain.friction=0.4", "duration_s=10")
    assert summary["verdict"] in ("slid", "fell")
    assert summary["simulated_s"] < 10.0
