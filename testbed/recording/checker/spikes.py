"""Single values that no machine makes: a row or two far outside everything that a channel does."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from testbed.formats.arrays import Array
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.raw import Mask, Raw

WINDOW, MOST_ROWS = 7, 2
"""Rows about each from which the median is taken, and how many in a row may be one spike."""
FAR = 1.0
"""A spike leaves the median by more than this share of the span of 99.8 % of the channel."""
COUNTS = 3.5
"""And by more than so many of the channel's steps: a sensor at rest flickers by a count or two."""
SMOOTH = ("position", "pressure_", "supply", "actuator", "force", "reference", "oil", "attitude")
"""Channels that cannot leave and come back within two rows; a command can."""


def spikes(values: Array, resolution: float = 0.0) -> Mask:
    """Rows (n,) that are spikes; `resolution`: the channel's declared step, 0 where none is."""
    from scipy.ndimage import median_filter

    low, high = np.quantile(values, [0.001, 0.999])
    away = np.abs(values - median_filter(values, WINDOW, mode="nearest"))
    step = max(resolution, _smallest_step(values))
    return np.asarray((away > FAR * (high - low)) & (away > COUNTS * step) & (high > low))


def _smallest_step(values: Array) -> float:
    """The smallest step of a channel that repeats its values as a counter does, 0 of any other."""
    levels = np.unique(values)
    if len(levels) < 2 or len(levels) > 0.1 * len(values):
        return 0.0
    return float(np.diff(levels).min())


def check_spikes(raw: Raw) -> Iterator[tuple[Finding, Mask]]:
    """Each channel that has spikes, with the rows of them."""
    for name, values in raw.series.items():
        if not name.startswith(SMOOTH) or not np.isfinite(values).all():
            continue
        there = spikes(values, raw.resolutions.get(name, 0.0))
        rows = np.flatnonzero(there)
        if not rows.size or rows.size > MOST_ROWS * max(1, len(values) // 1000):
            continue
        beside = values[max(rows[0] - 1, 0)] if rows[0] else values[rows[0] + 1]
        yield (
            Finding(
                "error",
                name,
                "has spikes",
                f"{rows.size} rows, first row {rows[0]}: {values[rows[0]]:.6g} beside {beside:.6g}",
                "leave these rows out",
                float(raw.time_s[rows[0]]),
                float(raw.time_s[rows[-1]]),
            ),
            there,
        )
