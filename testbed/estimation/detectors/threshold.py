"""Threshold on one rung of the paper's ladder: the score is how far the load lies below zero, N."""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from testbed.estimation.detectors.base import scaled_limits

Array = NDArray[np.float64]


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
    """The load with the friction that the oil tells (derived.py)."""

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
