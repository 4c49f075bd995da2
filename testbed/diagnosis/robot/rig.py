"""What a diagnosis of the robot asks of a recording, and what reaches a spool of its command."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from testbed.compiled import njit
from testbed.laws.valve import play
from testbed.machine.groups import Valve
from testbed.recording.robot_columns import OF_BODY

Array = npt.NDArray[np.float64]
NEEDED = OF_BODY
"""Without these the whole machine cannot be balanced."""


def through_amplifier(command: Array, time_s: Array, valve: Valve) -> Array:
    """What reaches the spool's loop of a command, shape (n,): the declared amplifier lag, then the
    declared play.
    """
    period = float(np.median(np.diff(time_s)))
    keep = float(np.exp(-period / valve.amplifier_lag_s))
    return np.asarray(_lag_and_play(command, keep, valve.hysteresis), dtype=np.float64)


@njit
def _lag_and_play(command: Array, keep: float, half_width: float) -> Array:
    out = np.empty_like(command)
    lagged, state = command[0], command[0]
    for i in range(len(command)):
        lagged = command[i] + (lagged - command[i]) * keep
        state = play(state, lagged, half_width)
        out[i] = state
    return out
