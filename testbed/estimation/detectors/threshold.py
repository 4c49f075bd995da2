"""Threshold on one rung of the paper's ladder: the score is how far the load lies below zero, N."""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from testbed.estimation.detectors.base import scaled_limits
from testbed.formats.arrays import Array


class Threshold:
    """On one estimate of the load; no numbers, no state."""

    name: ClassVar[str]
    text: ClassVar[str]
    threshold: float
    load: ClassVar[str]
    """The estimate's name in `row.estimate`."""

    def update(self, sample: Any) -> Array:
        """Scores (4,)."""
        return -np.asarray(sample["row"]["estimate"][self.load])

    def scores(self, samples: NDArray[Any]) -> Array:
        """`update` over samples (n,): (n, 4)."""
        return -np.asarray(samples["row"]["estimate"][self.load])

    def scaled(self, force: float) -> Self:
        """The same for a machine whose forces are so many times as large."""
        return scaled_limits(type(self)(), force)


class OneChamber(Threshold):
    """Equation (1)."""

    name, text = "threshold_one_chamber", "threshold on one chamber (1)"
    load = "one_chamber"
    threshold = -2085.8


class TwoChamber(Threshold):
    """Equation (3)."""

    name, text = "threshold_two_chamber", "threshold on two chambers (3)"
    load = "two_chamber"
    threshold = -530.6


class LessFriction(Threshold):
    """Equation (7)."""

    name, text = "threshold_friction", "threshold on the force less friction (7)"
    load = "friction"
    threshold = -34.6


class PublishedFilter(Threshold):
    """Equation (6)."""

    name, text = "threshold_kbf", "threshold on the published filter"
    load = "kbf"
    threshold = -294.8


class PublishedModifiedFilter(Threshold):
    """Figure 10."""

    name, text = "threshold_modified_kbf", "threshold on the published modified filter"
    load = "modified_kbf"
    threshold = -305.0


class Own(Threshold):
    """The whole-body estimate."""

    name, text = "threshold_own", "threshold on the own estimate"
    load = "own"
    threshold = -178.3


class Carried:
    """The load with the friction that the oil tells (sample.py)."""

    name, text = "threshold_carried", "threshold on the load with sliding seals"
    threshold = -50.0

    def update(self, sample: Any) -> Array:
        """Scores (4,)."""
        return -np.asarray(sample["derived"]["carried"])

    def scores(self, samples: NDArray[Any]) -> Array:
        """`update` over samples (n,): (n, 4)."""
        return -np.asarray(samples["derived"]["carried"])

    def scaled(self, force: float) -> Self:
        """The same for a machine whose forces are so many times as large."""
        return scaled_limits(type(self)(), force)


# Expected against estimated: the share of the load that statics expect and the pressures do not
# show.

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
