"""Gaps of a recording: a straight line across one is a motion at one speed that nobody saw, with a
jerk at both ends. Nothing is computed from it. What lies beyond a recording's ends nobody saw
either.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from testbed.formats.arrays import Array, Flags
from testbed.recording.axis import Recording
from testbed.recording.checks import MINIMUM_SAMPLES

GAP_STEPS, GAP_S, BESIDE_GAP_S = 3.5, 0.02, 0.06
"""Samples farther apart than so many usual steps, and than this, have a gap between them; what is
left out beside it, where smoothing carries it."""


def before_gaps(time_s: Array, usual_s: float | None = None) -> NDArray[np.intp]:
    """Rows of times (n,) behind which samples are missing; `usual_s`: their usual distance, None:
    the median.
    """
    steps = np.diff(time_s)
    usual_s = float(np.median(steps)) if usual_s is None else usual_s
    return np.flatnonzero(steps > max(GAP_STEPS * usual_s, GAP_S))


def in_gaps(sampled_s: Array, time_s: Array) -> Flags:
    """Which of `time_s` (n,) lie in a gap of the samples, or so near to one that smoothing carries
    it there.
    """
    out = np.zeros(len(time_s), dtype=np.bool_)
    for row in before_gaps(sampled_s):
        out |= (time_s > sampled_s[row] - BESIDE_GAP_S) & (
            time_s < sampled_s[row + 1] + BESIDE_GAP_S
        )
    return out


def at_ends(time_s: Array) -> Flags:
    """Which of `time_s` (n,) lie so near to an end of a recording that smoothing takes in what
    nobody saw: a machine that lurches there is read as one that goes on as it went.
    """
    return np.asarray(
        (time_s < time_s[0] + BESIDE_GAP_S) | (time_s > time_s[-1] - BESIDE_GAP_S), dtype=np.bool_
    )


def stretches(recording: Recording) -> list[Recording]:
    """A recording parted at its gaps; a stretch too short for a velocity of its own stays with the
    one before.
    """
    ends = [0]
    for row in before_gaps(recording.time_s):
        if row + 1 - ends[-1] >= MINIMUM_SAMPLES and len(recording) - row > MINIMUM_SAMPLES:
            ends.append(int(row) + 1)
    ends.append(len(recording))
    if len(ends) == 2:
        return [recording]
    return [recording.part(slice(*pair), recording.name) for pair in itertools.pairwise(ends)]
