"""A rival: Kalman filter whose innovation is cut off at +-limit: a far sample pulls, but no more
than a near one.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.estimation.filters.base import over
from testbed.estimation.filters.kbf import KalmanState, only_predict, predict_and_update, start
from testbed.formats.records import Record, quantity


class Numbers(Record):
    """The filter's constants."""

    process_variance = quantity("N2", "Q: variance of one step of the random walk")
    measurement_variance = quantity("N2", "R: variance of a sample")
    limit = quantity("N", "an innovation pulls no more than this one")


@njit
def step(state: Any, z: float, numbers: Any) -> float:
    """One sample."""
    q, r = numbers.process_variance, numbers.measurement_variance
    if state.started == 0.0:
        return float(start(state, z, r))
    if not np.isfinite(z):
        return float(only_predict(state, q))
    error = min(max(z - state.value, -numbers.limit), numbers.limit)
    return float(predict_and_update(state, state.value + error, q, r))


run = over(step, KalmanState, Numbers)
