"""Early warning: the load has fallen below a fifth of what it was, and falls so that it will soon be gone.

`was` is the highest smoothed load, forgotten over some ten seconds. One warning a fall: the next one needs the load
back first. The score is 1 while a warning stands, else 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.detectors.signals import BALANCE, CARRIED, OWN

Array = NDArray[np.float64]
LOAD, SLOW, WAS, STARTED, STANDS, STATE_SIZE = range(6)
BACK = 2.0
"""A warning ends once the load is back at this many times the share."""


@njit
def step(signals: Array, state: Array, p: Array, score: Array) -> None:
    """p = [share of the load, s to look ahead, mean s, slower mean s, memory s, step s, least load it was N,
    load that is taken for none N]."""
    for foot in range(4):
        s = state[foot]
        load = (signals[BALANCE, foot] + signals[OWN, foot] + signals[CARRIED, foot]) / 3.0
        if s[STARTED] == 0.0:
            s[LOAD] = s[SLOW] = s[WAS] = load
            s[STARTED] = 1.0
        s[LOAD] += (load - s[LOAD]) * p[5] / p[2]
        s[SLOW] += (load - s[SLOW]) * p[5] / p[3]
        s[WAS] = max(s[LOAD], s[WAS] * (1.0 - p[5] / p[4]))
        rate = (s[LOAD] - s[SLOW]) / (p[3] - p[2])
        low = p[0] * s[WAS]
        if s[STANDS] > 0.5:
            s[STANDS] = 1.0 if s[LOAD] < BACK * low else 0.0
        elif s[WAS] >= p[6] and s[LOAD] < low and s[LOAD] + p[1] * rate < p[7]:
            s[STANDS] = 1.0
        score[foot] = s[STANDS]


@njit
def run(signals: Array, state: Array, p: Array, score: Array) -> None:
    """`step` over n samples."""
    for n in range(signals.shape[0]):
        step(signals[n], state, p, score[n])
