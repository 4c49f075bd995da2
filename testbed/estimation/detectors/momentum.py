"""Momentum observer (De Luca) on the sliding frame: the external force without differentiating the velocity.

    r = K ( integral (balance - F_f(v) - r) dt - m v ),   dr/dt = K (F_ext - r)

balance = pA A_A - pB A_B + m g, F_f the published friction (5), F_ext the ground's push. The score is -r, N.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.detectors.signals import BALANCE, PUBLISHED, VELOCITY

Array = NDArray[np.float64]
INTEGRAL, RESIDUAL, STARTED, STATE_SIZE = range(4)


@njit
def step(signals: Array, state: Array, p: Array, score: Array) -> None:
    """p = [K 1/s, moving mass kg, step s]."""
    for foot in range(4):
        s = state[foot]
        force, momentum = (
            signals[BALANCE, foot] - signals[PUBLISHED, foot],
            p[1] * signals[VELOCITY, foot],
        )
        if s[STARTED] == 0.0:
            s[INTEGRAL], s[STARTED] = momentum + force / p[0], 1.0
        else:
            s[INTEGRAL] += p[2] * (force - s[RESIDUAL])
        s[RESIDUAL] = p[0] * (s[INTEGRAL] - momentum)
        score[foot] = -s[RESIDUAL]


@njit
def run(signals: Array, state: Array, p: Array, score: Array) -> None:
    """`step` over n samples."""
    for n in range(signals.shape[0]):
        step(signals[n], state, p, score[n])
