"""A rival: Kalman filter for Student-t noise of nu degrees of freedom, by variational updates of
the noise's scale.

Repeat: R_k = R (nu + (e^2 + P_k) / R) / (nu + 1), e = z - x_k; update (x_k, P_k) from the prior
with R_k.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.estimation.filters.base import over
from testbed.estimation.filters.kbf import KalmanState, only_predict, start
from testbed.formats.records import Record, quantity

ITERATIONS = 5


class Numbers(Record):
    """The filter's constants."""

    process_variance = quantity("N2", "Q: variance of one step of the random walk")
    measurement_variance = quantity("N2", "R: variance of a sample")
    freedom = quantity("1", "nu: degrees of freedom of the noise; 4 is common")


@njit
def step(state: Any, z: float, numbers: Any) -> float:
    """One sample."""
    q, r = numbers.process_variance, numbers.measurement_variance
    if state.started == 0.0:
        return float(start(state, z, r))
    if not np.isfinite(z):
        return float(only_predict(state, q))
    prior, nu = state.variance + q, numbers.freedom
    x, variance = state.value, prior
    for _ in range(ITERATIONS):
        noise = r * (nu + ((z - x) ** 2 + variance) / r) / (nu + 1.0)
        gain = prior / (prior + noise)
        x, variance = state.value + gain * (z - state.value), (1.0 - gain) * prior
    state.value, state.variance = x, variance
    return float(x)


run = over(step, KalmanState, Numbers)
