"""An observation in the units of its table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from testbed.envs.observations import TABLE, Observed


def in_units(
    observation: NDArray[np.float32], table: Sequence[Observed] = TABLE
) -> dict[str, float]:
    """Column -> value in its unit, from a normalised observation (clipped rows stay clipped)."""
    return {
        row.column: float((row.high + row.low) / 2 + value * (row.high - row.low) / 2)
        for row, value in zip(table, observation, strict=True)
    }
