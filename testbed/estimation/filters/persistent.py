"""The testbed's own filter: a gate that cannot lock out, because what persists is believed.

A sample outside the gate is not used, but it opens a candidate: a second Kalman filter that follows the rejected
samples. A spike ends before the candidate is `hold` samples old, and leaves no mark; a true step or a fast unload
goes on, and then the candidate becomes the estimate, at its full height at once.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from testbed.estimation.filters.kbf import predict_and_update, start

STATE_SIZE = 7
"""x, P, started, candidate's x, its P, started, its number of samples."""


@njit(cache=True)
def step(state: NDArray[np.float64], z: float, p: NDArray[np.float64]) -> float:
    """One sample. p = [Q, R, e_max, hold]: N2, N2, N, samples; a sample that is not a number only propagates P."""
    if not np.isfinite(z):
        state[1] += p[0]
        return float(state[0])
    if state[2] == 0.0:
        return float(start(state, z, p[1]))
    if abs(z - state[0]) <= p[2]:
        state[6] = 0.0
        return float(predict_and_update(state, z, p[0], p[1]))
    state[1] += p[0]
    candidate = state[3:6]
    if state[6] > 0.0 and abs(z - candidate[0]) <= p[2]:
        predict_and_update(candidate, z, p[0], p[1])
        state[6] += 1.0
    else:
        start(candidate, z, p[1])
        state[6] = 1.0
    if state[6] >= p[3]:
        state[0], state[1], state[6] = candidate[0], candidate[1], 0.0
    return float(state[0])


@njit(cache=True)
def run(z: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
    """The filter over an array z[n] in N; returns x[n] in N."""
    state = np.zeros(STATE_SIZE)
    x = np.empty(z.size)
    for k in range(z.size):
        x[k] = step(state, z[k], p)
    return x
