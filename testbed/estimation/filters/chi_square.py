"""A rival: Kalman filter with a chi-square gate on the innovation.

A sample is used only if e^2 / (P + Q + R) <= limit. The gate widens as P grows, by Q a sample: for a step of several kN
and the Q of a smooth filter that takes minutes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.filters.kbf import STATE_SIZE, predict_and_update, start


@njit
def step(state: NDArray[np.float64], z: float, p: NDArray[np.float64]) -> float:
    """One sample. p = [Q, R, limit]: N2, N2, 1 (6.63 passes 99 % of what the model expects)."""
    if state[2] == 0.0:
        return float(start(state, z, p[1])) if np.isfinite(z) else 0.0
    if not np.isfinite(z):
        state[1] += p[0]
        return float(state[0])
    error = z - state[0]
    if error * error > p[2] * (state[1] + p[0] + p[1]):
        state[1] += p[0]
        return float(state[0])
    return float(predict_and_update(state, z, p[0], p[1]))


@njit
def run(z: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
    """The filter over an array z[n] in N; returns x[n] in N."""
    state = np.zeros(STATE_SIZE)
    x = np.empty(z.size)
    for k in range(z.size):
        x[k] = step(state, z[k], p)
    return x
