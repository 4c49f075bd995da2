"""Threshold on one rung of the paper's ladder: the score is how far the estimate lies below zero, N."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit

Array = NDArray[np.float64]
STATE_SIZE = 0


@njit
def step(signals: Array, state: Array, p: Array, score: Array) -> None:
    """p = [row of the signal]."""
    row = int(p[0])
    for foot in range(4):
        score[foot] = -signals[row, foot]


@njit
def run(signals: Array, state: Array, p: Array, score: Array) -> None:
    """`step` over n samples."""
    for n in range(signals.shape[0]):
        step(signals[n], state, p, score[n])
