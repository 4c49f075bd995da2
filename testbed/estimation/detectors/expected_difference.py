"""Expected against estimated: the share of the load that statics expect and the pressures do not show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.detectors.signals import EXPECTED, OWN

Array = NDArray[np.float64]
STATE_SIZE = 0


@njit
def step(signals: Array, state: Array, p: Array, score: Array) -> None:
    """p = [least expected load N]: a foot that is expected to carry less is judged as if it were to carry this."""
    for foot in range(4):
        score[foot] = 1.0 - signals[OWN, foot] / max(signals[EXPECTED, foot], p[0])


@njit
def run(signals: Array, state: Array, p: Array, score: Array) -> None:
    """`step` over n samples."""
    for n in range(signals.shape[0]):
        step(signals[n], state, p, score[n])
