"""CUSUM (Page): the log-likelihood ratio of `no load` against `little load`, added up while it speaks for the loss.

    S = max(0, S + (m1 - m0) / s^2 (L - (m0 + m1) / 2)),   m1 = 0 N lost, m0 = the least load still carried

One sample adds no more than `limit`, so that a spike alone is no alarm. In nats.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit

Array = NDArray[np.float64]
STATE_SIZE = 1
HIGHEST = 60.0


@njit
def step(signals: Array, state: Array, p: Array, score: Array) -> None:
    """p = [row, m0 N, s N, limit]."""
    row = int(p[0])
    for foot in range(4):
        gain = -p[1] / (p[2] * p[2]) * (signals[row, foot] - 0.5 * p[1])
        state[foot, 0] = min(max(state[foot, 0] + min(max(gain, -p[3]), p[3]), 0.0), HIGHEST)
        score[foot] = state[foot, 0]


@njit
def run(signals: Array, state: Array, p: Array, score: Array) -> None:
    """`step` over n samples."""
    for n in range(signals.shape[0]):
        step(signals[n], state, p, score[n])
