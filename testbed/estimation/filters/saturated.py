"""A rival: Kalman filter whose innovation is cut off at +-limit: a far sample pulls, but no more than a near one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.filters.kbf import STATE_SIZE, predict_and_update, start


@njit
def step(state: NDArray[np.float64], z: float, p: NDArray[np.float64]) -> float:
    """One sample. p = [Q, R, limit]: N2, N2, N."""
    if state[2] == 0.0:
        return float(start(state, z, p[1])) if np.isfinite(z) else 0.0
    if not np.isfinite(z):
        state[1] += p[0]
        return float(state[0])
    error = min(max(z - state[0], -p[2]), p[2])
    return float(predict_and_update(state, state[0] + error, p[0], p[1]))


@njit
def run(z: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
    """The filter over an array z[n] in N; returns x[n] in N."""
    state = np.zeros(STATE_SIZE)
    x = np.empty(z.size)
    for k in range(z.size):
        x[k] = step(state, z[k], p)
    return x
