"""Single samples far from their neighbours."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from testbed.formats.arrays import Array, Flags
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.raw import Raw

WINDOW, MOST_ROWS = 7, 2
"""Rows about each from which the median is taken, and how many in a row may be one spike."""
FAR = 1.0
"""A spike leaves the median by more than this share of the span of 99.8 % of the channel."""
COUNTS = 3.5
"""And by more than so many of the channel's steps: a sensor at rest flickers by a count or two."""
SMOOTH = ("position", "pressure_", "supply", "actuator", "force", "reference", "oil", "attitude")
"""Channels that cannot leave and come back within two rows; a command can."""


def spikes(values: Array, resolution: float = 0.0) -> Flags:
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


LANDING_S, UNLOADED = 0.05, 0.1
"""How long after a foot bore next to nothing, as a share of its strong forces, it may still be
struck by the ground (E)."""


def _landing(values: Array, time_s: Array) -> Flags:
    """Rows (n,) in which a foot bears more than just before, that bore next to nothing within
    LANDING_S and goes on to bear: what strikes a foot that comes down may be over within a row.
    """
    rate_hz = 1.0 / max(float(np.median(np.diff(time_s))), 1e-9)
    rows, places = max(round(LANDING_S * rate_hz), 2), np.arange(len(values))
    unloaded = values < UNLOADED * float(np.quantile(np.abs(values), 0.95))
    last_off = np.maximum.accumulate(np.where(unloaded, places, -len(values)))
    next_on = np.minimum.accumulate(np.where(unloaded, 2 * len(values), places)[::-1])[::-1]
    bears = np.append(next_on[1:] - places[:-1] <= rows, False)
    rises = np.diff(values, prepend=values[0]) > 0.0
    return np.asarray(rises & ~unloaded & (places - last_off <= rows) & bears)


def check_spikes(raw: Raw) -> Iterator[tuple[Finding, Flags]]:
    """Each channel that has spikes, with the rows of them."""
    for name, values in raw.series.items():
        if not name.startswith(SMOOTH) or not np.isfinite(values).all():
            continue
        there = spikes(values, raw.resolutions.get(name, 0.0))
        if raw.rig == "foot":
            there &= ~_landing(values, raw.time_s)
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
