"""Early warning: the load is low for this foot, falls, and will soon be gone before anything known ends its fall.

A critically damped alpha-beta filter gives level L and slope V of each foot's load, and the rate of the ordered thrust.
What the thrust may explain of a fall, at most `kappa` of its rate, ends when the thrust stops rising, which the drill's
program knows beforehand; the rest may go on. A warning is raised where

    L + V_thrust min(look_thrust, rising, left) + V_rest min(look, left) < warn at,
    V_rest = min(V + kappa max(thrust rate, 0), 0),  V_thrust = V - V_rest

`left` is the time until the foot across has nothing left to give: (L_o - gone) / -V_o, 0 where it is gone. Feet across
from each other share a twist and fall together; once one hangs free the other bears what statics give it, and its fall
ends. So only the first of them is warned of.

A warning stands for two seconds at least, and until the load is back. The score is 1 while it stands, else 0.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit

Array = NDArray[np.float64]
SIGNALS = ("load", "thrust", "rising")
LOAD, THRUST, RISING = range(len(SIGNALS))
"""What the warning looks at, means of one step: a load N; the ordered thrust N and how long it still rises s, the
same for all feet, 0 where nothing is known of them."""
LEVEL, SLOPE, PUSH, PUSH_RATE, MEAN, WAS, USUAL, STARTED, STANDS_S, STATE_SIZE = range(10)
NUMBERS = (
    "smooth_s",
    "share",
    "look_s",
    "look_thrust_s",
    "warn_at_n",
    "usual_s",
    "gone_n",
    "kappa",
    "step_s",
    "least_n",
)
SMOOTH_S, SHARE, LOOK_S, LOOK_THRUST_S, WARN_AT_N, USUAL_S, GONE_N, KAPPA, STEP_S, LEAST_N = range(
    len(NUMBERS)
)
"""Time constant of the filter; share of the usual load below which a foot is low; how far to look ahead, and under a
rising thrust; predicted load below which to warn; time over which a load is usual; load at which the foot across counts
as gone; largest share of a thrust that a foot feels; step; what a foot must have borne."""
BACK = 2.0
"""A warning ends once the load is back at this many times the share of what is usual."""
STANDS_LEAST_S, MEAN_S, MEMORY_S = 2.0, 0.02, 15.0
"""How long a warning speaks for; time constants of a foot's mean and of the memory of the most that it bore."""


@njit
def alpha_beta(s: Array, at: int, value: float, p: Array) -> None:
    """One sample into the level s[at] and the slope s[at + 1]."""
    keep = math.exp(-p[STEP_S] / p[SMOOTH_S])
    foreseen = s[at] + s[at + 1] * p[STEP_S]
    s[at] = foreseen + (1.0 - keep * keep) * (value - foreseen)
    s[at + 1] += (1.0 - keep) ** 2 * (value - foreseen) / p[STEP_S]


@njit
def follow(s: Array, load: float, thrust: float, p: Array) -> None:
    """One sample into the state of one foot."""
    if s[STARTED] == 0.0:
        s[LEVEL] = s[MEAN] = s[WAS] = s[USUAL] = load
        s[PUSH], s[STARTED] = thrust, 1.0
    alpha_beta(s, LEVEL, load, p)
    alpha_beta(s, PUSH, thrust, p)
    s[MEAN] += (load - s[MEAN]) * min(p[STEP_S] / MEAN_S, 1.0)
    s[WAS] = max(s[MEAN], s[WAS] * (1.0 - p[STEP_S] / MEMORY_S))
    s[USUAL] += (load - s[USUAL]) * p[STEP_S] / p[USUAL_S]


@njit
def time_left_s(across: Array, p: Array) -> float:
    """Seconds until the foot across is gone, at most the longest look."""
    left = max(p[LOOK_S], p[LOOK_THRUST_S])
    if across[MEAN] <= p[GONE_N]:
        left = 0.0
    elif across[SLOPE] < 0.0:
        left = min(left, max(across[LEVEL] - p[GONE_N], 0.0) / -across[SLOPE])
    return float(left)


@njit
def foreseen_n(s: Array, left_s: float, rising_s: float, p: Array) -> float:
    """Load at the end of the look ahead, N."""
    rest = min(s[SLOPE] + p[KAPPA] * max(s[PUSH_RATE], 0.0), 0.0)
    by_thrust = min(s[SLOPE], 0.0) - rest
    thrust_s = min(p[LOOK_THRUST_S], min(rising_s, left_s))
    return float(s[LEVEL] + by_thrust * thrust_s + rest * min(p[LOOK_S], left_s))


@njit
def step(signals: Array, state: Array, p: Array, score: Array) -> None:
    """signals [SIGNALS, 4]; p = SMOOTH_S .. LEAST_N."""
    for foot in range(4):
        follow(state[foot], signals[LOAD, foot], signals[THRUST, foot], p)
    for foot in range(4):
        s = state[foot]
        low = p[SHARE] * s[USUAL]
        if s[STANDS_S] > 0.0:
            s[STANDS_S] += p[STEP_S]
            if s[STANDS_S] > STANDS_LEAST_S and s[LEVEL] > BACK * low:
                s[STANDS_S] = 0.0
        elif s[WAS] >= p[LEAST_N] and s[LEVEL] < low and s[SLOPE] < 0.0:
            left = time_left_s(state[3 - foot], p)
            if left > 0.0 and foreseen_n(s, left, signals[RISING, foot], p) < p[WARN_AT_N]:
                s[STANDS_S] = p[STEP_S]
        score[foot] = 1.0 if s[STANDS_S] > 0.0 else 0.0


@njit
def run(signals: Array, state: Array, p: Array, score: Array) -> None:
    """`step` over n samples [n, SIGNALS, 4]."""
    for n in range(signals.shape[0]):
        step(signals[n], state, p, score[n])
