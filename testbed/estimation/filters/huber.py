"""A rival: Kalman filter with Huber's weight: beyond c standard deviations an innovation pulls
linearly less.

R is replaced by R |r| / c where |r| = |e| / sqrt(P + Q + R) > c.
"""

from __future__ import annotations

import math
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
    corner = quantity(
        "1", "c: standard deviations up to which a sample counts in full; usually 1.345"
    )


@njit
def step(state: Any, z: float, numbers: Any) -> float:
    """One sample."""
    q, r = numbers.process_variance, numbers.measurement_variance
    if state.started == 0.0:
        return float(start(state, z, r))
    if not np.isfinite(z):
        return float(only_predict(state, q))
    deviations = abs(z - state.value) / math.sqrt(state.variance + q + r)
    return float(predict_and_update(state, z, q, r * max(1.0, deviations / numbers.corner)))


run = over(step, KalmanState, Numbers)
