"""Expected against estimated: the share of the load that statics expect and the pressures do not
show.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LEAST_EXPECTED_N = 1000.0
"""A foot that is expected to carry less is judged as if it were to carry this."""


class Expected:
    """Without state."""

    name, text = "expected", "expected against estimated"
    threshold = 0.98

    def update(self, sample: Any) -> Array:
        """Scores (4,), 1."""
        return self.scores(sample)

    def scores(self, samples: Any) -> Array:
        """`update` over samples (n,): (n, 4)."""
        row = samples["row"]
        share = row["estimate"]["own"] / np.maximum(row["expected"], LEAST_EXPECTED_N)
        return np.asarray(1.0 - share)
