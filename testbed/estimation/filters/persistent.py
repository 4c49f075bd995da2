"""The testbed's own filter: a gate that cannot lock out, because what persists is believed.

Three rules on top of the KBF:

1. A sample outside the gate is not used, but counted. A spike ends before `hold_samples` samples in
   a row stood outside on one side, and leaves no mark; a true step goes on, and then the samples
   that were held back become the estimate at once.
2. A load that has just jumped is likely to go on moving: for a while afterwards Q is as large as R,
   the gate follows the larger innovation variance, and three samples outside are enough.
3. Outliers are rare by definition. Where more than a share of the last samples was outside
   (hammering), it is the load that moves: every sample is used, with rule 2's gain. So no input can
   be rejected for good.
"""

from __future__ import annotations

import math

import numpy as np

from testbed.compiled import njit
from testbed.estimation.filters import modified_kbf
from testbed.estimation.filters.base import over
from testbed.estimation.filters.kbf import KalmanState, only_predict, predict_and_update, start
from testbed.formats.records import Record, part, quantity

WHOLE = 0.5
"""Counts are whole numbers kept as floats: beyond this, at least one."""

FORGET = 0.8
"""What a sample inside the gate leaves of the count of those outside, as noise may interrupt a
small step.
"""
LIVELY_HOLD = 3.0
"""Samples in a row outside the gate that are enough while the load is lively."""
LIVELY_DECAY = 1.0 - 1.0 / 60.0
"""What a sample leaves of a load's liveliness: some tens of ms at 1 kHz."""
LIVELY_FROM = 0.05
"""A load this lively has just moved."""
LIVELY_SIGMAS = 5.0
"""Gate of a lively load, standard deviations of the innovation."""
REFRESH_SIGMAS = 2.5
"""Innovation that keeps a lively load lively, standard deviations."""
SHARE_LIMIT = 0.15
"""Share of samples outside the gate beyond which it is the load that moves."""
SHARE_RATE = 1.0 / 150.0
"""What a sample weighs in that share: 150 ms at 1 kHz."""


class PersistentState(Record):
    """What the filter knows."""

    estimate = part(KalmanState, "what is believed")
    held = part(KalmanState, "what is held back")
    count = quantity("1", "samples held back, signed by the side they are on")
    lively = quantity("1", "how lively the load is, 0 to 1")
    rejected = quantity("1", "share of samples outside the gate of late")


class Numbers(modified_kbf.Numbers):
    """The filter's constants."""

    hold_samples = quantity("1", "samples in a row outside the gate that are a true step")


@njit
def step(state: PersistentState, z: float, numbers: Numbers) -> float:
    """One sample; one that is not a number only propagates P."""
    now, q, r = state.estimate, numbers.process_variance, numbers.measurement_variance
    if not np.isfinite(z):
        return only_predict(now, q)
    if now.started == 0.0:
        state.lively = 0.0
        return start(now, z, r)
    state.lively *= LIVELY_DECAY
    lively = state.lively > LIVELY_FROM
    q += state.lively * r
    sigma = math.sqrt(now.variance + q + r)
    error, gate = z - now.value, numbers.innovation_limit
    outside = abs(error) > (max(gate, LIVELY_SIGMAS * sigma) if lively else gate)
    state.rejected += ((1.0 if outside else 0.0) - state.rejected) * SHARE_RATE
    restless = state.rejected > SHARE_LIMIT
    if restless or (lively and not outside and abs(error) > REFRESH_SIGMAS * sigma):
        state.lively = 1.0
    if restless or not outside:
        state.count *= FORGET
        return predict_and_update(now, z, q, r)
    now.variance += q
    hold_back(state, z, 1.0 if error > 0.0 else -1.0, numbers)
    if abs(state.count) >= (LIVELY_HOLD if lively else numbers.hold_samples):
        now.value, now.variance = state.held.value, state.held.variance
        state.count, state.lively, state.rejected = 0.0, 1.0, 0.0
    return now.value


@njit
def hold_back(state: PersistentState, z: float, side: float, numbers: Numbers) -> None:
    """Let the rejected sample join those before it on the same side, or open a new row of them."""
    q, r = numbers.process_variance, numbers.measurement_variance
    if state.count * side > WHOLE:
        predict_and_update(state.held, z, q + r, r)
        state.count += side
    else:
        state.held.value, state.held.variance, state.count = z, r, side


run = over(step, PersistentState, Numbers)
