"""A rival: Kalman filter with a chi-square gate on the innovation.

A sample is used only if e^2 / (P + Q + R) <= limit. The gate widens as P grows, by Q a sample: for
a step of several kN and the Q of a smooth filter that takes minutes.
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
    limit = quantity("1", "of e^2 / (P + Q + R); 6.63 passes 99 % of what the model expects")


@njit
def step(state: Any, z: float, numbers: Any) -> float:
    """One sample."""
    q, r = numbers.process_variance, numbers.measurement_variance
    if state.started == 0.0:
        return float(start(state, z, r))
    error = z - state.value
    if not np.isfinite(z) or error * error > numbers.limit * (state.variance + q + r):
        return float(only_predict(state, q))
    return float(predict_and_update(state, z, q, r))


run = over(step, KalmanState, Numbers)
