"""Where a valve's spool is after a recorded command."""

from __future__ import annotations

import numpy as np

from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.laws.second_order import second_order

COMMAND_LEAD_SAMPLES = 0.75
"""A row's command already acts in the sampling interval that the row closes: measured on recordings
of a sound leg.
"""


def spool(command: Array, rate_hz: float, natural_frequency_hz: float, damping: float) -> Array:
    """Spool position (-1..1), shape (n,): exact second-order response to a command held between
    samples.
    """
    step = second_order(2.0 * np.pi * natural_frequency_hz, damping, 1.0 / rate_hz)
    late = _following(np.asarray(command, dtype=np.float64), *step)
    index = np.arange(len(command), dtype=np.float64)
    return np.asarray(np.interp(index + COMMAND_LEAD_SAMPLES, index, late), dtype=np.float64)


@njit
def _following(command: Array, yy: float, yr: float, ry: float, rr: float) -> Array:
    """Position (n,) of a second-order system that starts at rest on its command, held between
    samples.
    """
    out = np.empty(command.size)
    place, rate = command[0], 0.0
    for index in range(command.size):
        out[index] = place
        off = place - command[index]
        place = command[index] + yy * off + yr * rate
        rate = ry * off + rr * rate
    return out
