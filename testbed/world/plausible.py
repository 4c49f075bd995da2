"""Rows that no machine can give end the run: not finite, or loads beyond all physics."""

from __future__ import annotations

import numpy as np

from testbed.errors import SimulationFault
from testbed.formats.arrays import Array
from testbed.recording.rows import DataRow, TruthRow

DATA_COLUMNS: tuple[str, ...] = tuple(DataRow.column_names())
TRUTH_COLUMNS: tuple[str, ...] = tuple(TruthRow.column_names())
LOADS = [
    k
    for k, name in enumerate(TRUTH_COLUMNS)
    if name.startswith(("foot_force_in_world_", "rope_force_in_world_", "drill_wrench_in_world_f"))
]
MOST_WEIGHTS = 1000.0
"""A load of so many times the weight of the machine is a fault of the simulation, no physics
(E).
"""


def check_rows(data: Array, truth: Array, weight_n: float) -> None:
    """Raise SimulationFault where a row of data or truth cannot be of a machine of this weight."""
    for name, block, columns in (("data", data, DATA_COLUMNS), ("truth", truth, TRUTH_COLUMNS)):
        finite = np.isfinite(block)
        if not finite.all():
            row, column = np.argwhere(~finite)[0]
            raise SimulationFault(
                f"{name} column {columns[column]} is not finite at t = {block[row, 0]:.3f} s"
            )
    beyond = np.abs(truth[:, LOADS]) > MOST_WEIGHTS * weight_n
    if beyond.any():
        row, column = np.argwhere(beyond)[0]
        raise SimulationFault(
            f"{TRUTH_COLUMNS[LOADS[column]]} is {truth[row, LOADS[column]]:.3g} N at "
            f"t = {truth[row, 0]:.3f} s, more than {MOST_WEIGHTS:g} times the machine's weight"
        )
