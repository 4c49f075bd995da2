"""Two models at once: `carries` (the load walks at random, and is no less than m0) and `lost` (the load is zero).

Each predicts the next estimate; Bayes' rule and a small chance of changing over between them give the odds. Loads are
judged with the spread s of estimates, a walk of q N a sample. The score is the log of the odds of `lost`, in nats.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit

Array = NDArray[np.float64]
LOAD, VARIANCE, ODDS, STARTED, STATE_SIZE = range(5)
LARGEST = 60.0


@njit
def changed_over(odds: float, chance: float) -> float:
    """Log odds after one sample in which either model may have become the other with this chance."""
    lost = 1.0 / (1.0 + math.exp(-odds))
    lost = lost * (1.0 - chance) + (1.0 - lost) * chance
    return math.log(lost / (1.0 - lost))


@njit
def step(signals: Array, state: Array, p: Array, score: Array) -> None:
    """p = [row, m0 N, s N, q N, chance, limit of one sample in nats]."""
    row = int(p[0])
    for foot in range(4):
        s, z = state[foot], signals[row, foot]
        if s[STARTED] == 0.0:
            s[LOAD], s[VARIANCE], s[STARTED], s[ODDS] = max(z, p[1]), p[2] ** 2, 1.0, -LARGEST / 2.0
        s[VARIANCE] += p[3] ** 2
        spread = s[VARIANCE] + p[2] ** 2
        carried, lost = z - s[LOAD], max(z, 0.0)
        gain = 0.5 * (
            carried * carried / spread - lost * lost / p[2] ** 2 + math.log(spread / p[2] ** 2)
        )
        s[ODDS] = changed_over(s[ODDS], p[4]) + min(max(gain, -p[5]), p[5])
        s[ODDS] = min(max(s[ODDS], -LARGEST / 2.0), LARGEST / 2.0)
        share = s[VARIANCE] / spread
        s[LOAD] = max(s[LOAD] + share * carried, p[1])
        s[VARIANCE] *= 1.0 - share
        score[foot] = s[ODDS]


@njit
def run(signals: Array, state: Array, p: Array, score: Array) -> None:
    """`step` over n samples."""
    for n in range(signals.shape[0]):
        step(signals[n], state, p, score[n])
