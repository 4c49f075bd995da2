"""The socket of force estimators: a foot load from every row, live and over a recording.

An estimator is any class with `update(row) -> loads (4,)`, N along the vertical joints' axes, positive when the ground
pushes a foot up. `row` is a DataRow (recording/rows.py): what was measured, and the shipped estimates beside it. It may
have `start(dt_s)`, called before the first row with the seconds between two.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from testbed.machine.names import LEGS

Array = NDArray[np.float64]


class Estimator(Protocol):
    """The socket."""

    def update(self, row: Any) -> Array:
        """Loads (4,) of this row, N."""
        ...


def loads_over(estimator: Estimator, rows: NDArray[Any]) -> Array:
    """An estimator's loads (n, 4), N, over DataRow records (n,), one after the other."""
    by_name = rows.view(np.recarray)
    return np.array([estimator.update(row) for row in by_name], float).reshape(-1, len(LEGS))
