"""A rival: Kalman filter for Student-t noise of nu degrees of freedom, by variational updates of the noise's scale.

Repeat: R_k = R (nu + (e^2 + P_k) / R) / (nu + 1), e = z - x_k; update (x_k, P_k) from the prior with R_k.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.filters.kbf import STATE_SIZE, start

ITERATIONS = 5


@njit
def step(state: NDArray[np.float64], z: float, p: NDArray[np.float64]) -> float:
    """One sample. p = [Q, R, nu]: N2, N2, 1 (4 is common)."""
    if state[2] == 0.0:
        return float(start(state, z, p[1])) if np.isfinite(z) else 0.0
    if not np.isfinite(z):
        state[1] += p[0]
        return float(state[0])
    prior = state[1] + p[0]
    x, variance = state[0], prior
    for _ in range(ITERATIONS):
        noise = p[1] * (p[2] + ((z - x) ** 2 + variance) / p[1]) / (p[2] + 1.0)
        gain = prior / (prior + noise)
        x, variance = state[0] + gain * (z - state[0]), (1.0 - gain) * prior
    state[0], state[1] = x, variance
    return float(x)


@njit
def run(z: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
    """The filter over an array z[n] in N; returns x[n] in N."""
    state = np.zeros(STATE_SIZE)
    x = np.empty(z.size)
    for k in range(z.size):
        x[k] = step(state, z[k], p)
    return x
