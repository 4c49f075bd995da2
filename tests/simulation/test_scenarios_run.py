"""Every shipped scenario ends as it expects to, and does not under its mutation.

The runs are made beside the other tests (scenario_runs.py); each test waits for its own.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from scenario_runs import Runs

from testbed import resources
from testbed.scenario.scenario import load_scenario
from testbed.simulation.run import run_scenario

NAMES = sorted(p.stem for p in resources.folder("scenarios").glob("*.yaml"))
RUNS = [
    pytest.param(name, marks=pytest.mark.long if name.startswith("commissioning_") else ())
    for name in NAMES
]
"""Commissioning takes ten simulated minutes; shorter programmes are tested where they are made."""
KIN = (
    *("climber_8t_crawl", "climber_8t_drill", "quarter_model_crawl"),
    *("crawl_rough_45", "crawl_slope_30", "crawl_slope_75", "crawl_slope_85", "crawl_wave_45"),
    *("drill_deep", "drill_heavy_45", "drill_unknown_rock", "drill_wall_85"),
    *("rope_cut_75", "rope_cut_85", "sensor_dead"),
    *("stand_undeclared_drift", "stand_undeclared_friction", "stand_undeclared_leak"),
)
"""Scenarios with a near relation in the list that is changed in the same way: under their mutation
they run in the long tier. They all run as they are.
"""
MUTATED = [
    pytest.param(name, marks=pytest.mark.long) if name in KIN else run
    for name, run in zip(NAMES, RUNS, strict=True)
]


def _summary(folder: Path, name: str, *changes: str) -> dict[str, Any]:
    return run_scenario(load_scenario(name, changes), folder / name).summary


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
@pytest.mark.parametrize("mutated", [False])
def test_it_ends_as_expected(scenario_runs: Runs, name: str, mutated: bool) -> None:
    assert scenario_runs.unmet(name, mutated) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", MUTATED)
@pytest.mark.parametrize("mutated", [True])
def test_its_expectation_fails_under_its_mutation(
    scenario_runs: Runs, name: str, mutated: bool
) -> None:
    assert scenario_runs.unmet(name, mutated) != []


def test_kin_are_scenarios_that_there_are() -> None:
    assert set(KIN) < set(NAMES)


def test_every_scenario_has_an_expectation_and_a_mutation_that_can_be_read() -> None:
    for name in NAMES:
        scenario = load_scenario(name)
        assert scenario.expect.verdict or scenario.expect.summary, name
        assert scenario.mutation is not None, name
        changed = load_scenario(name, scenario.mutation.overrides())
        assert changed.expect == scenario.expect, (
            f"{name}: a mutation changes the world, not what is expected of it"
        )


@pytest.mark.slow
def test_without_the_hidden_gain_error_no_leg_stands_out(tmp_path: Path) -> None:
    summary = _summary(
        tmp_path, "stand_undeclared_gain", "undeclared=[]", "task.kind=stand", "duration_s=10"
    )
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
    summary = _summary(
        tmp_path, "stand_slope_45", "ropes.enabled=false", "terrain.friction=0.4", "duration_s=10"
    )
    assert summary["verdict"] in ("slid", "fell")
    assert summary["simulated_s"] < 10.0
