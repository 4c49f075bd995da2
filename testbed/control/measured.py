"""What control may look at: one tick's row of readings, estimates and control's own last orders, by
name.

The names are those of the recording (recording/rows.py), so that whatever runs live runs over a
recording as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.formats.arrays import Array, Columns
from testbed.formats.records import from_columns
from testbed.recording.rows import DataRow


class Measured:
    """One row of data: a copy that stays as it is when the next tick comes.

    Every field of DataRow is an attribute; declared here are those that are asked for most.
    """

    __slots__ = ("_row",)
    t: float
    """Time, s."""
    position: Array
    """(12) encoders, AXES order, rad (rotation) and m."""
    pressure_a: Array
    """(12) piston sides, Pa, gauge."""
    pressure_b: Array
    """(12) rod sides, Pa, gauge."""
    supply_pressure: float
    """Pa, gauge."""
    rope_tension: Array
    """(2) load pins of the left and right rope, N."""
    attitude: Array
    """(3) roll, pitch, yaw by the inertial unit, rad."""
    contact: Array
    """(4) contact state by the detector: 1 loaded, 0 contact lost."""

    def __init__(self, row: NDArray[Any]) -> None:
        """row: one DataRow, as an array of one record."""
        self._row = np.frombuffer(bytearray(row.tobytes()), DataRow.dtype)[0]

    @classmethod
    def of(cls, **readings: Any) -> Measured:
        """A row of zeros with these readings: fields of DataRow, or `load`."""
        return cls(DataRow.zeros(1)).but(**readings)

    def but(self, **readings: Any) -> Measured:
        """The same row with other readings."""
        row = np.array([self._row], DataRow.dtype)
        for name, value in readings.items():
            if name == "load":
                row["estimate"]["own"] = value
            else:
                row[name] = value
        return Measured(row)

    def __getattr__(self, name: str) -> Any:
        """A field of the row."""
        if name in DataRow.fields:
            return self._row[name]
        raise AttributeError(f"a row of data has no {name}")

    @property
    def load(self) -> Array:
        """(4) estimated load of each foot along its vertical joint, N."""
        load: Array = self._row["estimate"]["own"]
        return load

    @property
    def drill(self) -> Any:
        """What the drill's own controls know: a record with the fields of DrillKnown."""
        return self._row


def rows_of(columns: Columns) -> NDArray[Any]:
    """Recorded columns, each (n,), as n rows (DataRow); what was not recorded is zero."""
    return from_columns(DataRow, columns, len(next(iter(columns.values()))))


# One number that an agent or a trained controller sees: what it is, and the range that becomes -1
# to 1.


@dataclass(frozen=True)
class Observed:
    """A row of an observation's table."""

    column: str
    """Column of the run's data, or a name under `orders.` or `control.`: what control itself
    ordered or worked out.
    """
    meaning: str
    unit: str
    frame: str
    low: float
    high: float

    def times(self, factor: float) -> Observed:
        """The same row with a range so many times as large."""
        return replace(self, low=factor * self.low, high=factor * self.high)


def amounts(shares: Array, table: Sequence[Observed]) -> Array:
    """What numbers (n,) in [-1, 1], one a row, mean in the rows' units."""
    low, high = (np.array([getattr(row, end) for row in table]) for end in ("low", "high"))
    return np.asarray((high + low) / 2.0 + shares * (high - low) / 2.0)
