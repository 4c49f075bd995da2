"""A first start: it says what it does, two processes share the work, and the next start compiles nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from testbed.world import first_start

START = """
import json
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation
Simulation(load_scenario("drill_slope_45", duration=1.0)).run_block(1)
from testbed.estimation.live.chain_step import step_chain
from testbed.world.between import between_steps
from testbed.world.plant import plant_step
print(json.dumps({f.py_func.__name__: [len(f.signatures), sum(f.stats.cache_misses.values())]
                  for f in (between_steps, plant_step, step_chain)}))
"""


def _start(home: Path) -> tuple[dict[str, list[int]], str]:
    environment = os.environ | {"XDG_CACHE_HOME": str(home)}
    command = [sys.executable, "-c", START]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1]), done.stderr


@pytest.mark.slow
def test_two_processes_share_a_first_start_and_the_next_compiles_nothing(tmp_path: Path) -> None:
    first, said = _start(tmp_path)
    assert said.count("\n") == 1 and "first start" in said
    assert {count for count, _ in first.values()} == {1}  # as the step calls them, and no other
    assert first["between_steps"][1] == first["step_chain"][1] == 1
    if len(os.sched_getaffinity(0)) > 1:
        assert first["plant_step"][1] == 0  # the second process compiled it
    second, said = _start(tmp_path)
    assert said == ""
    assert all(missed == 0 for _, missed in second.values())


def test_a_warm_cache_starts_no_second_process_and_says_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(first_start, "is_cached", lambda _: True)
    monkeypatch.setattr(first_start.subprocess, "Popen", None)  # would raise
    first_start.beside()()
    assert capsys.readouterr().err == ""
