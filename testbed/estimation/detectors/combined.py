"""The testbed's own detector: the mean of three loads that err in different ways, over a few milliseconds.

They differ in the friction of a piston that hardly moves: none (`balance`, the middle of the set), `own` (memory that
drifts to the middle), `carried` (followed through the oil, signals.py). Each is wrong by up to the break-away force,
seldom all the same way: at equal recall the mean calls half as many loaded feet lost as the best of them. The score is
how far it lies below zero, N.

A sensor that drifts moves `balance` and `carried` without end, while `own` is held by what the whole machine weighs.
Friction can tell them apart by no more than the break-away force: what they differ from `own` beyond that, over many
seconds, is taken for the sensor's and given back.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.detectors.signals import BALANCE, CARRIED, OWN

Array = NDArray[np.float64]
MEAN, STARTED, BEHIND_BALANCE, BEHIND_CARRIED, STATE_SIZE = range(5)
NUMBERS = 7
"""How many numbers `step` takes."""


@njit
def beyond(difference_n: float, break_away_n: float) -> float:
    """What of a difference (N) friction does not explain."""
    if difference_n > break_away_n:
        return difference_n - break_away_n
    return min(difference_n + break_away_n, 0.0)


@njit
def step(signals: Array, state: Array, p: Array, score: Array) -> None:
    """p = [time of the mean s, weights of balance, own and carried, time over which a difference is taken for a
    sensor's s, break-away force N, step s]."""
    share, slow = p[6] / (p[0] + p[6]), p[6] / (p[4] + p[6])
    for foot in range(4):
        s = state[foot]
        balance, own, carried = signals[BALANCE, foot], signals[OWN, foot], signals[CARRIED, foot]
        s[BEHIND_BALANCE] += slow * (own - balance - s[BEHIND_BALANCE])
        s[BEHIND_CARRIED] += slow * (own - carried - s[BEHIND_CARRIED])
        balance += beyond(s[BEHIND_BALANCE], p[5])
        carried += beyond(s[BEHIND_CARRIED], p[5])
        load = p[1] * balance + p[2] * own + p[3] * carried
        s[MEAN] = load if s[STARTED] == 0.0 else s[MEAN] + share * (load - s[MEAN])
        s[STARTED] = 1.0
        score[foot] = -s[MEAN]


@njit
def run(signals: Array, state: Array, p: Array, score: Array) -> None:
    """`step` over n samples."""
    for n in range(signals.shape[0]):
        step(signals[n], state, p, score[n])
