"""The whole command `testbed run SCENARIO`, from its start to its written report, against the bare
engine.

Times are those of a clock on the wall, as a person has them: they are worth something on a quiet
machine alone. `processor_s` counts what all processes of the command together took. The command is
warm, as the second run of an installed one is: compiled functions and the modules' bytecode are
there, even where the environment keeps Python from writing it.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from testbed.benchmarks.speed.bench import bare_engine
from testbed.errors import InputError
from testbed.report.page import Table
from testbed.scenario.scenario import load_scenario

WARM_S = 20.0
"""Simulated time of the run that goes before: long enough for a report by processes that draw."""
ALLOWED_S = 2.0
"""What start, recording, pictures and report may take beyond the bare engine's steps."""


def command_speeds(names: Sequence[str]) -> list[dict[str, Any]]:
    """Per scenario: seconds of the command and of the bare engine for as many steps.

    Raises InputError for a scenario that cannot be run.
    """
    bare = bare_engine(())
    try:
        return [_speed(name, bare.step) for name in names]
    finally:
        bare.close()


def command_table(found: Sequence[dict[str, Any]]) -> Table:
    """A scenario a row."""
    rows = [[f"{v:.3g}" if isinstance(v, float) else v for v in row.values()] for row in found]
    return Table("Speed of whole commands", list(found[0]), rows)


def _speed(name: str, step: Callable[[], Any]) -> dict[str, Any]:
    scenario = load_scenario(name)
    with TemporaryDirectory() as folder:
        _timed(name, Path(folder), "--duration", f"{WARM_S:g}")
        command_s, processor_s = _timed(name, Path(folder))
    start = time.perf_counter()
    for _ in range(round(scenario.duration_s * scenario.rates.physics_hz)):
        step()
    bare_s = time.perf_counter() - start
    return {
        "scenario": scenario.name,
        "simulated_s": scenario.duration_s,
        "command_s": command_s,
        "processor_s": processor_s,
        "bare_s": bare_s,
        "beyond_s": command_s - bare_s,
        "allowed_s": ALLOWED_S,
    }


def _timed(name: str, folder: Path, *options: str) -> tuple[float, float]:
    """Seconds on the wall, and of all processors, of `testbed run`, which keeps all in `folder`."""
    env = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    out = folder / ("warm" if options else "run")
    before, start = os.times(), time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "testbed", "run", name, "--out", str(out), *options],
        env=env | {"PYTHONPYCACHEPREFIX": str(folder / "bytecode")},
        capture_output=True,
        text=True,
    )
    took, after = time.perf_counter() - start, os.times()
    if not (out / "report.html").is_file():
        raise InputError(
            f"leaves no report: {done.stderr.strip()[-200:]}", field="command", value=name
        )
    spent = after.children_user + after.children_system
    return took, spent - before.children_user - before.children_system


# Speed of whole scenarios against the bare engine: every step of a run, from its first to its last.
#
# The bare engine takes its turns between the run's blocks, so that both see the same machine; see
# bench.py for what it does. Rows are written into memory, as a run's are before the recorder stores
# them.

BLOCK = 250
BARE_STEPS = 300
EVERY = 8
"""Blocks of a run between two turns of the bare engine."""
BOUND_EVEN, BOUND_UNEVEN = 0.8, 1.6


def scenario_speeds(names: Iterable[str]) -> list[dict[str, Any]]:
    """Per scenario: microseconds per step, full and bare, their ratio and what it must not pass on
    this ground.
    """
    bare = bare_engine(())
    try:
        return [_scenario_speed(name, bare) for name in names]
    finally:
        bare.close()


def scenario_table(found: Sequence[dict[str, Any]]) -> Table:
    """A scenario a row."""
    rows = [
        [f"{value:.3g}" if isinstance(value, float) else value for value in row.values()]
        for row in found
    ]
    return Table("Speed of whole scenarios", list(found[0]), rows)


def _scenario_speed(name: str, bare: Any) -> dict[str, Any]:
    from testbed.world.simulation import Simulation

    scenario = load_scenario(name)
    world = Simulation(scenario)
    even = world.machine.ground.heights_m is None
    ratios, full, bare_us = [], [], 1.0
    try:
        block = 0
        while not world.finished:
            if block % EVERY == 0:
                bare_us = _bare_us(bare)
            block, first = block + 1, time.thread_time()
            data, _ = world.run_block(BLOCK)
            steps = len(data) * world.scenario.rates.physics_hz / world.scenario.rates.record_hz
            if steps:
                full.append((time.thread_time() - first) / steps * 1e6)
                ratios.append(full[-1] / bare_us)
    finally:
        world.close()
    return {
        "scenario": scenario.name,
        "ground": "plane" if even else "height field",
        "full_step_us": statistics.mean(full),
        "ratio": statistics.mean(ratios),
        "bound": BOUND_EVEN if even else BOUND_UNEVEN,
    }


def _bare_us(bare: Any) -> float:
    start = time.thread_time()
    for _ in range(BARE_STEPS):
        bare.step()
    return (time.thread_time() - start) / BARE_STEPS * 1e6
