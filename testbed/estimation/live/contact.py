"""Foot on the ground or not, from a force estimate: a first word per foot.

A detector is a compiled `step(state, load_n, dt_s, p) -> word` with a state of STATE_SIZE numbers; the live chain calls
the one below inside its own compiled step. Others stand beside it, one file each, with the same signature.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit

STATE_SIZE = 2
WORD, SINCE = range(STATE_SIZE)
"""The word (0 or 1) and for how long the load has contradicted it, s."""


@njit
def step(s: NDArray[np.float64], load_n: float, dt_s: float, p: NDArray[np.float64]) -> float:
    """Hysteresis with dwell: 1 once load >= p[0] has lasted p[2] s, 0 once load <= p[1] has lasted p[3] s.

    p = [on N, off N, dwell on s, dwell off s], on > off; in between the word stays, also with a load that is no number.
    """
    contradicts = load_n <= p[1] if s[WORD] > 0.5 else load_n >= p[0]
    s[SINCE] = s[SINCE] + dt_s if contradicts else 0.0
    dwell = p[3] if s[WORD] > 0.5 else p[2]
    if contradicts and s[SINCE] >= dwell - 0.5 * dt_s:
        s[WORD], s[SINCE] = 1.0 - s[WORD], 0.0
    return float(s[WORD])


@njit
def run(
    load_n: NDArray[np.float64], dt_s: float, p: NDArray[np.float64], first: float
) -> NDArray[np.float64]:
    """The words over an array of loads in N, starting from the word `first` (0 or 1)."""
    s = np.zeros(STATE_SIZE)
    s[WORD] = first
    words = np.empty(load_n.size)
    for k in range(load_n.size):
        words[k] = step(s, load_n[k], dt_s, p)
    return words
