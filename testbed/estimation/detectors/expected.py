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
    """Without state. `least_expected_n`: see LEAST_EXPECTED_N."""

    name, text = "expected", "expected against estimated"
    threshold = 0.98

    def __init__(self, least_expected_n: float = LEAST_EXPECTED_N) -> None:
        self._least_n = least_expected_n

    def scaled(self, force: float) -> Expected:
        """The same for a machine whose forces are so many times as large."""
        return Expected(force * self._least_n)

    def update(self, sample: Any) -> Array:
        """Scores (4,), 1."""
        return self.scores(sample)

    def scores(self, samples: Any) -> Array:
        """`update` over samples (n,): (n, 4)."""
        row = samples["row"]
        share = row["estimate"]["own"] / np.maximum(row["expected"], self._least_n)
        return np.asarray(1.0 - share)
