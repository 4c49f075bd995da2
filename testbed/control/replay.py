"""A gait over a recording: it is fed the rows that a run recorded, and its commands are kept
instead of followed.

rows = rows_of(columns)  # name -> (n,), as a recording has them
commands = replay(Mine(start), rows)
commands.joints - rows["reference"][commands.row]
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.control.gait import Gait
from testbed.control.measured import Measured
from testbed.formats.arrays import Array, Flags

TICK_S = 0.01
"""A gait is asked this often, live and here."""


@dataclass(frozen=True)
class Commands:
    """What a gait ordered tick by tick; the fields of Command, stacked."""

    row: NDArray[np.intp]
    """(n,) which row of the recording each tick saw."""
    t: Array
    """(n,) beginning of the tick, s."""
    joints: Array
    """(n, 12) set points at the end of the tick, rad and m."""
    rope_rates_m_s: Array
    """(n, 2)"""
    stance: Flags
    """(n, 4)"""
    hold_drill: Flags
    """(n,)"""


def rows_at_ticks(rows: NDArray[Any]) -> NDArray[np.intp]:
    """Which of recorded rows (n, DataRow), evenly spaced at 100 Hz or more, a tick sees."""
    step_s = float(np.median(np.diff(rows["t"])))
    ticks = rows["t"] / TICK_S
    return np.flatnonzero(np.abs(ticks - np.round(ticks)) * TICK_S < 0.5 * step_s)


def replay(gait: Gait, rows: NDArray[Any]) -> Commands:
    """Ask a gait at every tick of recorded rows (n, DataRow)."""
    seen = rows_at_ticks(rows)
    given = [
        gait.command(float(rows["t"][row]), TICK_S, Measured(rows[row : row + 1])) for row in seen
    ]
    return Commands(
        row=seen,
        t=rows["t"][seen],
        joints=np.array([command.joints for command in given]),
        rope_rates_m_s=np.array([command.rope_rates_m_s for command in given]),
        stance=np.array([command.stance for command in given]),
        hold_drill=np.array([command.hold_drill for command in given]),
    )
