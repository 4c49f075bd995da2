"""Generalised likelihood ratio with the colour of the noise: whitened, then tested over several window lengths.

The estimate's error is coloured (hammering, the oil's own ring): L - m = c1 (..)_-1 + c2 (..)_-2 + e, e white. For the
whitened y = L - c1 L_-1 - c2 L_-2 a mean m gives c m, c = 1 - c1 - c2. Over the last n samples, with the mean M that
fits best,

    T_n = n / (2 s^2) [(c M - c max(M, m0))^2 - (c M - c min(M, m1))^2],   score = max over n

m0 the least load still carried, m1 the most that counts as lost, N. In nats, of either sign.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit

Array = NDArray[np.float64]
LENGTHS = (2, 5, 10, 20, 40)
LONGEST = 40
LAST, BEFORE, COUNT, RING = range(4)
SUMS = RING + LONGEST
STATE_SIZE = SUMS + len(LENGTHS)
LOWEST = -1.0e4


@njit
def step(signals: Array, state: Array, p: Array, score: Array) -> None:
    """p = [row, m0 N, m1 N, c1, c2, s N]."""
    row = int(p[0])
    gain = 1.0 - p[3] - p[4]
    for foot in range(4):
        s = state[foot]
        load = signals[row, foot]
        if s[COUNT] == 0.0:
            s[LAST] = s[BEFORE] = load
        y = (load - p[3] * s[LAST] - p[4] * s[BEFORE]) / gain
        s[BEFORE], s[LAST] = s[LAST], load
        count = int(s[COUNT])
        best = LOWEST
        for k in range(len(LENGTHS)):
            n = LENGTHS[k]
            s[SUMS + k] += y
            if count >= n:
                s[SUMS + k] -= s[RING + (count - n) % LONGEST]
            if count + 1 >= n:
                mean = s[SUMS + k] / n
                far, near = mean - max(mean, p[1]), mean - min(mean, p[2])
                best = max(best, 0.5 * n * (gain / p[5]) ** 2 * (far * far - near * near))
        s[RING + count % LONGEST] = y
        s[COUNT] += 1.0
        score[foot] = best


@njit
def run(signals: Array, state: Array, p: Array, score: Array) -> None:
    """`step` over n samples."""
    for n in range(signals.shape[0]):
        step(signals[n], state, p, score[n])
