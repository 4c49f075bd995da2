"""One number that an agent or a trained controller sees: what it is, and the range that becomes -1
to 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from testbed.formats.arrays import Array


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
