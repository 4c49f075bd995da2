"""Early warning: the load is below a fifth of what it was, and falls so that it will be gone soon.

`was` is the highest smoothed load, forgotten over tens of seconds. The score is 1 while the warning stands, else 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.detectors.signals import CARRIED, OWN

Array = NDArray[np.float64]
LOAD, SLOW, WAS, STARTED, STATE_SIZE = range(5)
LOST_N = 300.0


@njit
def step(signals: Array, state: Array, p: Array, score: Array) -> None:
    """p = [share of the load, s to look ahead, mean s, slower mean s, memory s, step s, offset N]."""
    for foot in range(4):
        s = state[foot]
        load = 0.5 * (signals[OWN, foot] + signals[CARRIED, foot]) - p[6]
        if s[STARTED] == 0.0:
            s[LOAD] = s[SLOW] = s[WAS] = load
            s[STARTED] = 1.0
        s[LOAD] += (load - s[LOAD]) * p[5] / p[2]
        s[SLOW] += (load - s[SLOW]) * p[5] / p[3]
        s[WAS] = max(s[LOAD], s[WAS] * (1.0 - p[5] / p[4]))
        rate = (s[LOAD] - s[SLOW]) / (p[3] - p[2])
        soon = s[LOAD] + p[1] * rate < LOST_N
        score[foot] = 1.0 if rate < 0.0 and soon and s[LOAD] < p[0] * s[WAS] else 0.0


@njit
def run(signals: Array, state: Array, p: Array, score: Array) -> None:
    """`step` over n samples."""
    for n in range(signals.shape[0]):
        step(signals[n], state, p, score[n])
