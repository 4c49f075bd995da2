"""Threshold on one rung of the paper's ladder: the score is how far the load lies below zero, N."""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from testbed.estimation.detectors.base import scaled_limits
from testbed.formats.arrays import Array
from testbed.formats.records import get


class Threshold:
    """On one estimate of the load; no numbers, no state."""

    name: ClassVar[str]
    text: ClassVar[str]
    threshold: float
    load: ClassVar[str]
    """The estimate's path in a `Sample`."""

    def update(self, sample: NDArray[Any]) -> Array:
        """Scores (4,)."""
        return self.scores(sample)

    def scores(self, samples: NDArray[Any]) -> Array:
        """`update` over samples (n,): (n, 4)."""
        return -np.asarray(get(samples, self.load))

    def scaled(self, force: float) -> Self:
        """The same for a machine whose forces are so many times as large."""
        return scaled_limits(type(self)(), force)


class OneChamber(Threshold):
    """Equation (1)."""

    name, text = "threshold_one_chamber", "threshold on one chamber (1)"
    load = "row.estimate.one_chamber"
    threshold = -2085.8


class TwoChamber(Threshold):
    """Equation (3)."""

    name, text = "threshold_two_chamber", "threshold on two chambers (3)"
    load = "row.estimate.two_chamber"
    threshold = -530.6


class LessFriction(Threshold):
    """Equation (7)."""

    name, text = "threshold_friction", "threshold on the force less friction (7)"
    load = "row.estimate.friction"
    threshold = -34.6


class PublishedFilter(Threshold):
    """Equation (6)."""

    name, text = "threshold_kbf", "threshold on the published filter"
    load = "row.estimate.kbf"
    threshold = -294.8


class PublishedModifiedFilter(Threshold):
    """Figure 10."""

    name, text = "threshold_modified_kbf", "threshold on the published modified filter"
    load = "row.estimate.modified_kbf"
    threshold = -305.0


class Own(Threshold):
    """The whole-body estimate."""

    name, text = "threshold_own", "threshold on the own estimate"
    load = "row.estimate.own"
    threshold = -178.3


class Carried(Threshold):
    """The load with the friction that the oil tells (sample.py)."""

    name, text = "threshold_carried", "threshold on the load with sliding seals"
    load = "derived.carried"
    threshold = -50.0


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
