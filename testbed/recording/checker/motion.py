"""Position, speed and acceleration on an even grid, rough but without surprises: for signs and
scales only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from testbed.formats.arrays import Array, Flags
from testbed.recording.checker.raw import Raw

WIDTH_S, WIDTH_SAMPLES = 0.012, 2.0
MOVING_M_S = 3e-3
"""Slower than this the direction of friction is not certain."""


@dataclass(frozen=True, eq=False)
class Even:
    """Channels (n,) of one axis on an even grid, smoothed alike, SI; `command` as it was held, not
    smoothed.
    """

    rate_hz: float
    speed_m_s: Array
    acceleration_m_s2: Array
    series: Mapping[str, Array]

    @property
    def moving(self) -> Flags:
        """Where the piston slides for certain, (n,)."""
        return np.asarray(np.abs(self.speed_m_s) > MOVING_M_S)


def even(raw: Raw, names: Mapping[str, str], position: str = "position") -> Even:
    """The channels `names` (name here -> quantity) of one axis; `position` gives speed and
    acceleration.
    """
    from scipy.ndimage import gaussian_filter1d

    time = raw.time_s
    step = float(np.median(np.diff(time)))
    grid = np.arange(time[0], time[-1], step)
    width = max(WIDTH_S / step, WIDTH_SAMPLES)

    def smooth(values: Array) -> Array:
        return np.asarray(gaussian_filter1d(np.interp(grid, time, values), width, mode="nearest"))

    speed = np.gradient(smooth(raw.series[position]), step)
    acceleration = np.gradient(smooth(speed_on(speed, grid, time)), step)
    series = {
        name: (
            raw.series[key][np.minimum(np.searchsorted(time, grid), len(time) - 1)]
            if name == "command"
            else smooth(raw.series[key])
        )
        for name, key in names.items()
        if key in raw.series
    }
    return Even(1.0 / step, speed, acceleration, series)


def speed_on(speed: Array, grid: Array, time: Array) -> Array:
    """`speed` given on the grid, at the recording's own times."""
    return np.asarray(np.interp(time, grid, speed))
