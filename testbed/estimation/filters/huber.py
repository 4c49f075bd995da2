"""A rival: Kalman filter with Huber's weight: beyond c standard deviations an innovation pulls linearly less.

R is replaced by R |r| / c where |r| = |e| / sqrt(P + Q + R) > c.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.filters.kbf import STATE_SIZE, predict_and_update, start


@njit
def step(state: NDArray[np.float64], z: float, p: NDArray[np.float64]) -> float:
    """One sample. p = [Q, R, c]: N2, N2, 1 (1.345 is the usual c)."""
    if state[2] == 0.0:
        return float(start(state, z, p[1])) if np.isfinite(z) else 0.0
    if not np.isfinite(z):
        state[1] += p[0]
        return float(state[0])
    r = abs(z - state[0]) / math.sqrt(state[1] + p[0] + p[1])
    return float(predict_and_update(state, z, p[0], p[1] * max(1.0, r / p[2])))


@njit
def run(z: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
    """The filter over an array z[n] in N; returns x[n] in N."""
    state = np.zeros(STATE_SIZE)
    x = np.empty(z.size)
    for k in range(z.size):
        x[k] = step(state, z[k], p)
    return x
