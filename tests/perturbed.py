"""Runs that differ in one number or field, compared bit by bit with the run that they differ from."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation

BLOCK = 100
"""Rows that are compared at a time; a run ends at the first block that differs."""
Changes = tuple[str, ...]


@lru_cache(maxsize=32)
def rows_of(name: str, changes: Changes) -> NDArray[np.float64]:
    """Data and truth of a run, side by side: (rows, columns)."""
    simulation = Simulation(load_scenario(name, changes))
    try:
        blocks = []
        while not simulation.finished:
            blocks.append(np.hstack(simulation.run_block(BLOCK)))
        return np.vstack(blocks)
    finally:
        simulation.close()


def changes_recording(name: str, base: Changes, change: Changes) -> bool:
    """Whether a run with `change` on top of `base` records other bits. Raises InputError where it is refused."""
    scenario = load_scenario(name, (*base, *change))
    plain = rows_of(name, base)
    simulation, first = Simulation(scenario), 0
    try:
        while not simulation.finished:
            rows = np.hstack(simulation.run_block(BLOCK))
            if rows.tobytes() != plain[first : first + len(rows)].tobytes():
                return True
            first += len(rows)
        return first != len(plain)
    finally:
        simulation.close()
