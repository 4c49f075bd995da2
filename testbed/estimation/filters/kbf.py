"""The paper's Kalman-based filter (KBF): a scalar Kalman filter for a random walk.

x_k = x_(k-1) + w, w ~ N(0, Q);  z_k = x_k + n, n ~ N(0, R)  (the paper's equation 6)
    P- = P + Q,  K = P- / (P- + R),  x = x + K (z - x),  P = (1 - K)^2 P- + K^2 R
"""

from __future__ import annotations

import numpy as np

from testbed.compiled import njit
from testbed.estimation.filters.base import over
from testbed.formats.records import Record, quantity


class KalmanState(Record):
    """Of a scalar Kalman filter."""

    value = quantity("N", "x: the estimate")
    variance = quantity("N2", "P: its variance")
    started = quantity("1", "1 once there was a sample")


class Numbers(Record):
    """The filter's constants."""

    process_variance = quantity("N2", "Q: variance of one step of the random walk")
    measurement_variance = quantity("N2", "R: variance of a sample")


@njit
def predict_and_update(state: KalmanState, z: float, q: float, r: float) -> float:
    """One full Kalman step (Joseph form, as filterpy's); units of z, q and r are N, N2, N2."""
    prior = state.variance + q
    gain = prior / (prior + r)
    state.value += gain * (z - state.value)
    state.variance = (1.0 - gain) * (1.0 - gain) * prior + gain * gain * r
    return state.value


@njit
def only_predict(state: KalmanState, q: float) -> float:
    """A step without a sample: the variance grows."""
    state.variance += q
    return state.value


@njit
def start(state: KalmanState, z: float, r: float) -> float:
    """The first sample is the first estimate, known as well as one measurement: P = R; no number
    starts nothing.
    """
    if not np.isfinite(z):
        return 0.0
    state.value, state.variance, state.started = z, r, 1.0
    return z


@njit
def step(state: KalmanState, z: float, numbers: Numbers) -> float:
    """One sample through the KBF; a sample that is not a number only propagates P."""
    if state.started == 0.0:
        return start(state, z, numbers.measurement_variance)
    if not np.isfinite(z):
        return only_predict(state, numbers.process_variance)
    return predict_and_update(state, z, numbers.process_variance, numbers.measurement_variance)


run = over(step, KalmanState, Numbers)
