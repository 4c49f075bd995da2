"""A first start: it says what it does, two processes share the work, and the next start compiles
nothing.
"""

from __future__ import annotations

import fcntl
import json
import os
import subprocess
import sys
import threading
import time
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


@pytest.mark.long
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


def test_a_process_that_starts_meanwhile_waits_and_compiles_nothing_again(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """While another process has its turn the step is compiled: nothing is left to do, and nothing
    is said.
    """
    monkeypatch.setattr(first_start, "caches", lambda: tmp_path)
    other = os.open(tmp_path / "first_start.lock", os.O_RDWR | os.O_CREAT)
    fcntl.flock(other, fcntl.LOCK_EX)
    found = iter([False, True])  # before the wait, and after it
    monkeypatch.setattr(first_start, "is_cached", lambda _: next(found))
    monkeypatch.setattr(first_start.subprocess, "Popen", None)  # would raise
    begin = time.monotonic()
    threading.Timer(0.2, os.close, [other]).start()
    first_start.beside()()
    assert time.monotonic() - begin >= 0.2
    assert capsys.readouterr().err == ""
    assert not first_start._held


def test_a_process_does_not_wait_for_itself(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(first_start, "caches", lambda: tmp_path)
    first_start._take_turn()
    first_start._take_turn()  # after a world that could not be built
    assert len(first_start._held) == 1
    first_start._end_turn()
