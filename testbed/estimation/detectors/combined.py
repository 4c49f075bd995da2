"""The testbed's own detector: the mean of three loads that err in different ways, over a few milliseconds.

They differ in the friction of a piston that hardly moves: none (`balance`, the middle of the set), `own` (memory that
drifts to the middle), `carried` (followed through the oil, signals.py). Each is wrong by up to the break-away force,
seldom all the same way: at equal recall the mean calls half as many loaded feet lost as the best of them. The score is
how far it lies below zero, N.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.detectors.signals import BALANCE, CARRIED, OWN

Array = NDArray[np.float64]
MEAN, STARTED, STATE_SIZE = range(3)


@njit
def step(signals: Array, state: Array, p: Array, score: Array) -> None:
    """p = [time of the mean s, weights of balance, own and carried, step s]."""
    share = p[4] / (p[0] + p[4])
    for foot in range(4):
        s = state[foot]
        load = p[1] * signals[BALANCE, foot] + p[2] * signals[OWN, foot] + p[3] * signals[CARRIED, foot]
        s[MEAN] = load if s[STARTED] == 0.0 else s[MEAN] + share * (load - s[MEAN])
        s[STARTED] = 1.0
        score[foot] = -s[MEAN]


@njit
def run(signals: Array, state: Array, p: Array, score: Array) -> None:
    """`step` over n samples."""
    for n in range(signals.shape[0]):
        step(signals[n], state, p, score[n])
