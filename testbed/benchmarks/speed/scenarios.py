"""Speed of whole scenarios against the bare engine: every step of a run, from its first to its
last.

The bare engine takes its turns between the run's blocks, so that both see the same machine; see
bench.py for what it does. Rows are written into memory, as a run's are before the recorder stores
them.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterable, Sequence
from typing import Any

from testbed.benchmarks.speed.bench import bare_engine
from testbed.report.page import Table
from testbed.scenario.scenario import load_scenario

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
        return [_speed(name, bare) for name in names]
    finally:
        bare.close()


def table(found: Sequence[dict[str, Any]]) -> Table:
    """A scenario a row."""
    rows = [
        [f"{value:.3g}" if isinstance(value, float) else value for value in row.values()]
        for row in found
    ]
    return Table("Speed of whole scenarios", list(found[0]), rows)


def _speed(name: str, bare: Any) -> dict[str, Any]:
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
