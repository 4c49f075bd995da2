"""The testbed's own filter: a gate that cannot lock out, because what persists is believed.

Three rules on top of the KBF:
1. A sample outside the gate is not used, but counted. A spike ends before `hold` samples in a row stood outside on one
   side, and leaves no mark; a true step goes on, and then the samples that were held back become the estimate at once.
2. A load that has just jumped is likely to go on moving: for a while afterwards Q is as large as R, the gate follows
   the larger innovation variance, and three samples outside are enough.
3. Outliers are rare by definition. Where more than a share of the last samples was outside (hammering), it is the
   load that moves: every sample is used, with rule 2's gain. So no input can be rejected for good.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.filters.kbf import predict_and_update, start

STATE_SIZE = 9
X, P, STARTED, HELD_X, HELD_P, HELD_STARTED, COUNT, LIVELY, REJECTED = range(STATE_SIZE)
"""Estimate N, its variance N2, 0/1; the same of what is held back; samples held back (signed by side);
how lively the load is 0..1; share of samples outside of late."""

FORGET = 0.8
LIVELY_HOLD = 3.0
LIVELY_DECAY = 1.0 - 1.0 / 60.0
LIVELY_FROM = 0.05
LIVELY_SIGMAS, REFRESH_SIGMAS = 5.0, 2.5
SHARE_LIMIT, SHARE_RATE = 0.15, 1.0 / 150.0
"""FORGET: what a sample inside the gate leaves of the count, as noise may interrupt a small step. The rest in samples
at 1 kHz: a load stays lively for some tens of ms, the share is counted over 150 ms."""


@njit
def step(state: NDArray[np.float64], z: float, p: NDArray[np.float64]) -> float:
    """One sample. p = [Q, R, e_max, hold]: N2, N2, N, samples; a sample that is not a number only propagates P."""
    if not np.isfinite(z):
        state[P] += p[0]
        return float(state[X])
    if state[STARTED] == 0.0:
        return float(start(state, z, p[1]))
    state[LIVELY] *= LIVELY_DECAY
    lively = state[LIVELY] > LIVELY_FROM
    q = p[0] + state[LIVELY] * p[1]
    sigma = math.sqrt(state[P] + q + p[1])
    error = z - state[X]
    outside = abs(error) > (max(p[2], LIVELY_SIGMAS * sigma) if lively else p[2])
    state[REJECTED] += ((1.0 if outside else 0.0) - state[REJECTED]) * SHARE_RATE
    restless = state[REJECTED] > SHARE_LIMIT
    if restless or (lively and not outside and abs(error) > REFRESH_SIGMAS * sigma):
        state[LIVELY] = 1.0
    if restless or not outside:
        state[COUNT] *= FORGET
        return float(predict_and_update(state, z, q, p[1]))
    state[P] += q
    hold_back(state, z, 1.0 if error > 0.0 else -1.0, p)
    if abs(state[COUNT]) >= (LIVELY_HOLD if lively else p[3]):
        state[X], state[P] = state[HELD_X], state[HELD_P]
        state[COUNT], state[LIVELY], state[REJECTED] = 0.0, 1.0, 0.0
    return float(state[X])


@njit
def hold_back(state: NDArray[np.float64], z: float, side: float, p: NDArray[np.float64]) -> None:
    """Let the rejected sample join those before it on the same side, or open a new row of them."""
    if state[COUNT] * side > 0.5:
        predict_and_update(state[HELD_X:COUNT], z, p[0] + p[1], p[1])
        state[COUNT] += side
    else:
        state[HELD_X], state[HELD_P], state[COUNT] = z, p[1], side


@njit
def run(z: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
    """The filter over an array z[n] in N; returns x[n] in N."""
    state = np.zeros(STATE_SIZE)
    x = np.empty(z.size)
    for k in range(z.size):
        x[k] = step(state, z[k], p)
    return x
