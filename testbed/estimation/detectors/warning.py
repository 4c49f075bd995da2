"""Early warning: the load is below a fifth or so of what it was, falls, and will soon be gone before its fall can end.

Level L and slope V of each foot's own estimate come from a critically damped alpha-beta filter. A warning is raised
where L + V min(look, left) lies below `warn at`; `left` is the time until another foot has nothing left to give:

    left = min over the other feet of (L_o - gone) / -V_o,   0 where L_o <= gone

Four feet share a twist and so fall in pairs; once one of them hangs free the other three bear what statics give them,
and their fall ends. So only the foot that is to be gone first is warned of. `was` is the highest smoothed load,
forgotten over some ten seconds. One warning a fall: the next one needs the load back first. The score is 1 while a
warning stands, else 0.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.detectors.signals import OWN

Array = NDArray[np.float64]
LEVEL, SLOPE, MEAN, WAS, STARTED, STANDS, STATE_SIZE = range(7)
(SHARE, LOOK_S, WARN_AT_N, SMOOTH_S, GONE_N, MEMORY_S, STEP_S, LEAST_N) = range(8)
"""The numbers: share of what the load was; how far to look ahead; predicted load below which to warn; time constant of
the filter; load at which a foot counts as gone (the estimate of a free foot lies above nothing: its friction is a set);
memory of what the load was; step; what a foot must have borne."""
BACK = 2.0
"""A warning ends once the load is back at this many times the share."""
MEAN_S = 0.02


@njit
def follow(s: Array, load: float, p: Array) -> None:
    """One sample into level, slope and `was` of one foot."""
    if s[STARTED] == 0.0:
        s[LEVEL] = s[MEAN] = s[WAS] = load
        s[STARTED] = 1.0
    keep = math.exp(-p[STEP_S] / p[SMOOTH_S])
    news = load - (s[LEVEL] + s[SLOPE] * p[STEP_S])
    s[LEVEL] += s[SLOPE] * p[STEP_S] + (1.0 - keep * keep) * news
    s[SLOPE] += (1.0 - keep) ** 2 * news / p[STEP_S]
    s[MEAN] += (load - s[MEAN]) * min(p[STEP_S] / MEAN_S, 1.0)
    s[WAS] = max(s[MEAN], s[WAS] * (1.0 - p[STEP_S] / p[MEMORY_S]))


@njit
def time_left_s(state: Array, foot: int, p: Array) -> float:
    """Seconds until another foot is gone, at most `look`."""
    left = p[LOOK_S]
    for other in range(4):
        level, slope = state[other, LEVEL], state[other, SLOPE]
        if other != foot and level <= p[GONE_N]:
            left = 0.0
        elif other != foot and slope < 0.0:
            left = min(left, (level - p[GONE_N]) / -slope)
    return float(left)


@njit
def step(signals: Array, state: Array, p: Array, score: Array) -> None:
    """p = SHARE .. LEAST_N."""
    for foot in range(4):
        follow(state[foot], signals[OWN, foot], p)
    for foot in range(4):
        s = state[foot]
        low = p[SHARE] * s[WAS]
        if s[STANDS] > 0.5:
            s[STANDS] = 1.0 if s[LEVEL] <= BACK * low else 0.0
        elif s[WAS] >= p[LEAST_N] and s[LEVEL] < low and s[SLOPE] < 0.0:
            left = time_left_s(state, foot, p)
            s[STANDS] = 1.0 if left > 0.0 and s[LEVEL] + s[SLOPE] * left < p[WARN_AT_N] else 0.0
        score[foot] = s[STANDS]


@njit
def run(signals: Array, state: Array, p: Array, score: Array) -> None:
    """`step` over n samples."""
    for n in range(signals.shape[0]):
        step(signals[n], state, p, score[n])
