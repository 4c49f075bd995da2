"""From a robot's samples, which may come late, leave gaps or lack numbers, to the evenly spaced
rows that the estimators are stepped with.

A sample no later than the one before is left out. A gap is filled by linear interpolation as soon
as the next sample comes. A missing number (nan) keeps its last value. After a gap longer than
LONGEST_GAP_S the estimators start anew.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.chain import ESTIMATED, EstimatorChain, replay_chain, rows_of
from testbed.formats.arrays import Array, Columns
from testbed.machine.names import LEGS
from testbed.recording.rows import DataRow

LONGEST_GAP_S = 0.5
"""After a longer gap nothing of what was remembered is true any more, s (E)."""
COLUMNS = DataRow.column_names()
MEASURED = np.array([name not in ESTIMATED for name in COLUMNS])
TIME = COLUMNS.index("t")


class Arrived(NamedTuple):
    """What a sample brings: rows (k, columns) for the estimators, the last of them the sample
    itself, and whether they start anew.
    """

    rows: Array
    anew: bool


def arrived(last: Array | None, sample: Array, dt_s: float) -> Arrived | None:
    """The rows of a sample (columns,) that follows the row `last`; None where it comes too late."""
    time_s = sample[TIME]
    if not np.isfinite(time_s) or (last is not None and time_s <= last[TIME]):
        return None
    anew = last is not None and bool(time_s - last[TIME] > LONGEST_GAP_S)
    last = None if anew else last
    now = sample.copy()
    missing = ~np.isfinite(now) & MEASURED
    now[missing] = 0.0 if last is None else last[missing]
    before = now if last is None else last
    steps = max(round((time_s - before[TIME]) / dt_s), 1)
    parts = np.arange(1, steps)[:, None] / steps
    return Arrived(np.vstack([before + (now - before) * parts, now]), anew)


def replay_rows(columns: Columns, believed: Believed) -> NDArray[Any]:
    """The chain over a recording's columns: DataRow records (n,) with every estimate, as
    `Stream.update` tells them sample by sample. Raises as `rows_of`.
    """
    rows, chain = rows_of(columns, believed), EstimatorChain(believed)
    table = DataRow.as_table(rows)
    steps = np.diff(rows["t"]) / believed.dt_s if "t" in columns else np.ones(len(rows) - 1)
    if np.isfinite(table).all() and ((steps > 0.0) & (np.round(steps) <= 1.0)).all():
        replay_chain(rows, chain.belief, chain.state)
        return rows
    given, begins, at = [np.zeros((1, len(COLUMNS)))], [0], np.zeros(len(rows), dtype=np.intp)
    last, count = None, 1
    for index, sample in enumerate(table):
        found = arrived(last, sample, believed.dt_s)
        if found is not None:
            if found.anew:
                begins.append(count)
            given.append(found.rows)
            last, count = found.rows[-1], count + len(found.rows)
        at[index] = count - 1
    whole = DataRow.from_table(np.concatenate(given))
    for first, end in zip(begins, [*begins[1:], count], strict=True):
        chain.forget()
        replay_chain(whole[max(first, 1) : end], chain.belief, chain.state)
    return whole[at]


def replay(columns: Columns, believed: Believed) -> dict[str, Array]:
    """`replay_rows` as columns by name: what the chain fills of a recording."""
    table = DataRow.as_table(replay_rows(columns, believed))
    return {
        name: np.ascontiguousarray(table[:, k])
        for k, name in enumerate(DataRow.column_names())
        if name in ESTIMATED
    }


def forces(columns: Columns, believed: Believed) -> dict[str, Array]:
    """`t`, and per leg `force_<leg>_n` with `_low` and `_high`: what `testbed estimate` writes of a
    robot recording.
    """
    if "t" not in columns:
        raise InputError("the recording has no such column", field="t")
    estimates = replay(columns, believed)
    out = {"t": np.asarray(columns["t"])}
    for leg in LEGS:
        out[f"force_{leg}_n"] = estimates[f"estimate_own_{leg}"]
        out[f"force_{leg}_n_low"] = estimates[f"own_low_{leg}"]
        out[f"force_{leg}_n_high"] = estimates[f"own_high_{leg}"]
    return out
