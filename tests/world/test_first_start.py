"""A first start: it says what it does, other processes compile, and the next start compiles
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

MOST_BYTES = 370e6
"""What a process of a first start may hold."""
START = """
import json
import resource
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation
Simulation(load_scenario("drill_slope_45", duration=1.0)).run_block(1)
from testbed.estimation.live.chain import step_chain
from testbed.world.compiled_step import between_steps
from testbed.world.plant import plant_step
print(json.dumps({f.py_func.__name__: [len(f.signatures), sum(f.stats.cache_misses.values())]
                  for f in (between_steps, plant_step, step_chain)}))
own = next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM"))
print(1024 * max(int(own), resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss))
"""
"""Its own peak is asked of the kernel's status: ru_maxrss begins with that of the process that
started it, which has many tests behind it."""


def _start(home: Path) -> tuple[dict[str, list[int]], str, int]:
    """Functions -> signatures and cache misses; what was said; most bytes that a process held."""
    environment = os.environ | {"XDG_CACHE_HOME": str(home)}
    command = [sys.executable, "-c", START]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    functions, held = done.stdout.splitlines()[-2:]
    return json.loads(functions), done.stderr, int(held)


@pytest.mark.long
def test_children_compile_a_first_start_and_the_next_compiles_nothing(tmp_path: Path) -> None:
    first, said, held = _start(tmp_path)
    assert held <= MOST_BYTES
    assert said.count("\n") == 1 and "first start" in said
    assert first["between_steps"][0] == 1  # as the step calls it, and no other
    assert max(count for count, _ in first.values()) == 1
    assert all(missed == 0 for _, missed in first.values())  # the children's, found in the cache
    second, said, held = _start(tmp_path)
    assert said == "" and held <= MOST_BYTES
    assert all(missed == 0 for _, missed in second.values())


@pytest.fixture
def no_child(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A cache of its own, and a child process would raise."""
    monkeypatch.setattr(first_start, "caches", lambda: tmp_path)
    monkeypatch.setattr(first_start.subprocess, "run", None)
    return tmp_path


def test_a_warm_cache_starts_no_other_process_and_says_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], no_child: Path
) -> None:
    monkeypatch.setattr(first_start, "is_cached", lambda _: True)
    first_start.compile_apart()
    assert capsys.readouterr().err == ""


def test_a_process_that_starts_meanwhile_waits_and_compiles_nothing_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], no_child: Path
) -> None:
    """While another process has its turn the step is compiled: nothing is left to do, and nothing
    is said.
    """
    other = os.open(no_child / "first_start.lock", os.O_RDWR | os.O_CREAT)
    fcntl.flock(other, fcntl.LOCK_EX)
    found = iter([False, True])  # before the wait, and after it
    monkeypatch.setattr(first_start, "is_cached", lambda _: next(found))
    begin = time.monotonic()
    threading.Timer(0.2, os.close, [other]).start()
    first_start.compile_apart()
    assert time.monotonic() - begin >= 0.2
    assert capsys.readouterr().err == ""


def test_every_family_is_compiled_once_and_after_those_that_it_is_made_of(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """A child that fails is no fault: the step that needs what it was to compile, compiles it."""
    rows: list[int] = []
    monkeypatch.setattr(first_start, "caches", lambda: tmp_path)
    monkeypatch.setattr(first_start, "is_cached", lambda _: False)
    monkeypatch.setattr(
        first_start.subprocess, "run", lambda command, **options: rows.append(int(command[-1]))
    )
    first_start.compile_apart()
    assert sorted(rows) == list(range(len(first_start.ROWS)))
    done = [family for row in rows for family in first_start.ROWS[row]]
    assert set(done) == set(first_start.FAMILIES) and len(done) == len(set(done))
    order = [done.index(name) for name in ("balance", "body", "chain", "step")]
    assert order == sorted(order) and done.index("hydraulics") < done.index("plant")
    assert capsys.readouterr().err.count("first start") == 1


def test_each_family_of_a_row_has_a_process_of_its_own_and_its_turn(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def note(name: str) -> None:
        with (tmp_path / "done").open("a") as file:
            file.write(f"{name} {os.getpid()}\n")
        raise RuntimeError  # no fault of the row

    families = {name: lambda name=name: note(name) for name in "abc"}
    monkeypatch.setattr(first_start, "FAMILIES", families)
    first_start.compile_row("abc")
    names, processes = zip(
        *map(str.split, (tmp_path / "done").read_text().splitlines()), strict=True
    )
    assert names == ("a", "b", "c")
    assert len({*processes, str(os.getpid())}) == 4


def test_where_nothing_can_be_cached_no_child_compiles_in_vain(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], no_child: Path
) -> None:
    monkeypatch.setattr(first_start, "is_cached", lambda _: False)
    monkeypatch.setattr(first_start, "can_cache", lambda _: False)
    first_start.compile_apart()
    assert "every start compiles" in capsys.readouterr().err


def test_a_turn_ends_with_its_process_or_its_fault(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(first_start, "caches", lambda: tmp_path)
    with pytest.raises(RuntimeError), first_start._turn():
        raise RuntimeError
    with first_start._turn():  # would wait for ever
        assert (tmp_path / "first_start.lock").exists()
