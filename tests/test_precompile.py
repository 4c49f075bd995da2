"""A first start: two processes share the compilation, and what each compiles is what the step then calls."""

from __future__ import annotations

import inspect
import json
import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest

from testbed import compiled
from testbed.world import precompile
from testbed.world.between import between_steps
from testbed.world.board import Board

FIRST_START = """
import json, resource, time
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation
world = Simulation(load_scenario("drill_slope_45", duration=1.0))
world.run_block(1)
from testbed.world import precompile
world.machine.boards["clock"]["recorded"] = 0
calls = precompile.calls([precompile.EVERYTHING, *world._fixed, world._nowhere])
calls += precompile.estimator_calls()
beside = resource.getrusage(resource.RUSAGE_CHILDREN)
print(json.dumps({
    "cpu_s": time.process_time(), "beside_s": beside.ru_utime + beside.ru_stime,
    "signatures": {k.py_func.__name__: len(k.signatures) for k, _ in calls if k.apart},
    "compiled": {k.py_func.__name__: sum(k.stats.cache_misses.values()) for k, _ in calls if k.apart},
}))
"""


@pytest.mark.slow
def test_two_processes_compile_each_kernel_once(tmp_path: Path) -> None:
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path)}
    out = subprocess.run(
        [sys.executable, "-c", FIRST_START], env=environment, capture_output=True, text=True
    )
    found = json.loads(out.stdout.splitlines()[-1])
    assert set(found["signatures"].values()) == {1}  # as the step calls them, and no other
    if len(os.sched_getaffinity(0)) < 2:
        pytest.skip("one core: nothing runs beside")
    for kernel in ("plant_step", "balance"):
        assert found["compiled"][kernel] == 0
    assert found["compiled"]["step_chain"] == 1
    assert 1.0 / 3.0 < found["beside_s"] / found["cpu_s"] < 3.0  # the work is shared out evenly


def test_the_second_process_compiles_the_plant_for_the_types_that_the_step_hands_it() -> None:
    found = {
        kernel.py_func.__name__: given
        for kernel, given in precompile.calls(precompile.plant_arguments())
    }
    assert set(found) >= set(precompile.PLANT_KERNELS)
    (board,) = found["plant_step"]
    assert numba.typeof(board) == numba.typeof(Board.zeros()).dtype
    for kernel, given in (
        precompile.calls(precompile.plant_arguments()) + precompile.estimator_calls()
    ):
        inspect.signature(kernel.py_func).bind(*given)


def test_a_warm_cache_starts_no_second_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert not compiled.is_cached(between_steps)
    folder = compiled.folder_of(between_steps.py_func)
    folder.mkdir(parents=True)
    (folder / f"between_steps-{compiled.digest_of(between_steps)}.py311.1.nbc").write_bytes(b"")
    assert compiled.is_cached(between_steps)
    assert precompile.beside() is None
