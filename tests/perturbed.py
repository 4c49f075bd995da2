"""Runs that differ in one number or field, compared bit by bit with the run that they differ
from.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation

BLOCK = 100
"""Rows that are compared at a time; a run ends at the first block that differs."""
Run = tuple[str, tuple[str, ...]]
"""A scenario and what is changed in it."""


@lru_cache(maxsize=64)
def rows_of(run: Run) -> NDArray[np.float64]:
    """Data and truth of a run, side by side: (rows, columns)."""
    simulation = Simulation(load_scenario(*run))
    try:
        blocks = []
        while not simulation.finished:
            blocks.append(np.hstack(simulation.run_block(BLOCK)))
        return np.vstack(blocks)
    finally:
        simulation.close()


def changes_recording(run: Run, *changes: str, truth: bool = True) -> bool:
    """Whether `run` with further changes records other bits, of the data alone without `truth`.

    Raises InputError where it is refused.
    """
    name, given = run
    scenario = load_scenario(name, (*given, *changes))
    plain, first = rows_of(run), 0
    simulation = Simulation(scenario)
    try:
        looked_at = None if truth else len(simulation.data_columns)
        while not simulation.finished:
            rows = np.hstack(simulation.run_block(BLOCK))[:, :looked_at]
            if rows.tobytes() != plain[first : first + len(rows), :looked_at].tobytes():
                return True
            first += len(rows)
        return first != len(plain)
    finally:
        simulation.close()
