"""Rows of a run in memory, by the names of their fields and by those of the recording's columns."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.formats.arrays import Array
from testbed.formats.records import Record


class Rows:
    """Rows that have come so far: `rows["pressure_a"]` (n, 12), `rows["pressure_a_fl_vertical"]`
    (n,).

    A name is a field of the record (fields of fields go on: `rows["estimate"]["own"]`) or a column
    of the recording.
    """

    def __init__(self, record: type[Record]) -> None:
        self._record = record
        self._places = {name: index for index, name in enumerate(record.column_names())}
        self._blocks: list[Array] = []

    def add(self, table: Array) -> None:
        """The next rows (n, columns)."""
        self._blocks.append(table)

    def end_at(self, t_s: float) -> None:
        """Forget the rows after this time."""
        table = self.table
        self._blocks = [table[table[:, self._places["t"]] <= t_s + 1e-9]]

    @property
    def table(self) -> Array:
        """All rows as (n, columns), in the order of `columns`."""
        if len(self._blocks) != 1:
            whole = np.concatenate([np.empty((0, len(self._places))), *self._blocks])
            self._blocks = [whole]
        return self._blocks[0]

    @property
    def records(self) -> npt.NDArray[Any]:
        """All rows as records (n,)."""
        return self._record.from_table(self.table)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the recording's columns."""
        return tuple(self._places)

    def __len__(self) -> int:
        return sum(map(len, self._blocks))

    def __getitem__(self, name: str) -> Any:
        """A field or a column; raises KeyError for what is neither."""
        if name in self._record.fields:
            return self.records[name]
        return self.table[:, self._places[name]]

    def as_recorded(self) -> dict[str, Array]:
        """Every column as a file would hold it: time in full, all else to 24 bits."""
        narrow = self.table.astype(np.float32).astype(np.float64)
        return {
            name: self.table[:, place] if name == "t" else narrow[:, place]
            for name, place in self._places.items()
        }
