"""On another processor: verdicts alike, figures of a summary within 1 %; docs/limits.md says so.

The other processor is the least that x86-64 can be, played by this one: numba compiles without
fused products and wide vectors, and OpenBLAS takes its oldest kernels.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

SCENARIOS = (
    *("stand_slope_45", "stand_flat", "drill_slope_45", "crawl_slope_45", "crawl_slope_30"),
    *("rope_cut", "climber_8t_stand", "quarter_model_stand", "stand_undeclared_two", "slide"),
)
DURATION_S = 12.0
"""The drill hammers, feet step, and the rope is cut within it."""
OTHER = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "OPENBLAS_CORETYPE": "Prescott"}
RUN = """
import json, pathlib, sys, tempfile
from testbed.scenario.scenario import load_scenario
from testbed.simulation.run import run_scenario
with tempfile.TemporaryDirectory() as folder:
    scenario = load_scenario(sys.argv[1], duration=float(sys.argv[2]))
    print(json.dumps(run_scenario(scenario, pathlib.Path(folder, "run")).summary))
"""
WITHIN = 0.01
TIMES = "wall_s"
"""What a run took: the one thing that the processor may decide."""


def _summary(scenario: str, **environment: str) -> dict[str, Any]:
    done = subprocess.run(
        [sys.executable, "-c", RUN, scenario, str(DURATION_S)],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=True,
    )
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def _leaves(tree: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """Every value of a summary by its path."""
    if isinstance(tree, dict | list):
        parts = tree.items() if isinstance(tree, dict) else enumerate(tree)
        for key, part in parts:
            yield from _leaves(part, f"{place}.{key}")
    elif TIMES not in place:
        yield place, tree


@pytest.mark.long
@pytest.mark.skipif(platform.machine() != "x86_64", reason="the processors are of that kind")
@pytest.mark.parametrize("scenario", SCENARIOS)
def test_another_processor_gives_the_same_verdict_and_figures(scenario: str) -> None:
    here, there = (dict(_leaves(_summary(scenario, **more))) for more in ({}, OTHER))
    assert here.keys() == there.keys()
    for place, value in here.items():
        if isinstance(value, float):
            assert there[place] == pytest.approx(value, rel=WITHIN, abs=1e-9), place
        else:
            assert there[place] == value, place


def test_the_scenarios_are_shipped_ones() -> None:
    shipped = {path.stem for path in (Path(__file__).parents[2] / "scenarios").glob("*.yaml")}
    assert len(set(SCENARIOS) & shipped) == 10
