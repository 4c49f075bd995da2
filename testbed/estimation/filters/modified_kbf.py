"""The paper's modified KBF (6, Fig. 10): the state update is skipped while |z_k - x_(k-1)| > e_max.

P goes on being propagated, P = P + Q. As published the gate is constant: after a true step of the force above
e_max every later sample is rejected too, for ever (lock-out). Kept as it is, to be shown.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.filters.kbf import STATE_SIZE, predict_and_update, start


@njit
def step(state: NDArray[np.float64], z: float, p: NDArray[np.float64]) -> float:
    """One sample. p = [Q, R, e_max, ...] in N2, N2, N; a sample that is not a number is rejected."""
    if state[2] == 0.0:
        return float(start(state, z, p[1])) if np.isfinite(z) else 0.0
    if not abs(z - state[0]) <= p[2]:
        state[1] += p[0]
        return float(state[0])
    return float(predict_and_update(state, z, p[0], p[1]))


@njit
def run(z: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
    """The modified KBF over an array z[n] in N; returns x[n] in N."""
    state = np.zeros(STATE_SIZE)
    x = np.empty(z.size)
    for k in range(z.size):
        x[k] = step(state, z[k], p)
    return x
