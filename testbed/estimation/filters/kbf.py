"""The paper's Kalman-based filter (KBF): a scalar Kalman filter for a random walk.

x_k = x_(k-1) + w, w ~ N(0, Q);  z_k = x_k + n, n ~ N(0, R)  (the paper's equation 6)
    P- = P + Q,  K = P- / (P- + R),  x = x + K (z - x),  P = (1 - K)^2 P- + K^2 R
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit

STATE_SIZE = 3
"""state[0] = x, state[1] = P, state[2] = 1 once a first sample has been seen."""


@njit
def predict_and_update(state: NDArray[np.float64], z: float, q: float, r: float) -> float:
    """One full Kalman step (Joseph form, as filterpy's); units of z, q and r are N, N2, N2."""
    prior = state[1] + q
    gain = prior / (prior + r)
    state[0] += gain * (z - state[0])
    state[1] = (1.0 - gain) * (1.0 - gain) * prior + gain * gain * r
    return float(state[0])


@njit
def start(state: NDArray[np.float64], z: float, r: float) -> float:
    """The first sample is the first estimate, known as well as one measurement: P = R."""
    for k in range(state.shape[0]):
        state[k] = 0.0
    state[0], state[1], state[2] = z, r, 1.0
    return z


@njit
def step(state: NDArray[np.float64], z: float, p: NDArray[np.float64]) -> float:
    """One sample through the KBF. p = [Q, R, ...] in N2; a sample that is not a number only propagates P."""
    if state[2] == 0.0:
        return float(start(state, z, p[1])) if np.isfinite(z) else 0.0
    if not np.isfinite(z):
        state[1] += p[0]
        return float(state[0])
    return float(predict_and_update(state, z, p[0], p[1]))


@njit
def run(z: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
    """The KBF over an array z[n] in N; returns x[n] in N."""
    state = np.zeros(STATE_SIZE)
    x = np.empty(z.size)
    for k in range(z.size):
        x[k] = step(state, z[k], p)
    return x
