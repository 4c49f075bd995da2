"""Long series made short enough to draw, without losing a peak."""

from __future__ import annotations

import numpy as np

from testbed.formats.arrays import Array

THOUSAND = 1e3


def envelope(time_s: Array, values: Array, bins: int = 420) -> tuple[Array, Array]:
    """At most `2 bins` points: the smallest and the largest value of each of `bins` equal
    stretches, in turn.

    A series that is short enough comes back as it is. Values that are not finite are passed over
    where a stretch holds others.
    """
    if len(time_s) <= 2 * bins:
        return time_s, values
    starts = np.linspace(0, len(time_s), bins, endpoint=False).astype(int)
    lows, highs = np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)
    width = (time_s[-1] - time_s[0]) / bins
    out_t, out_y = np.empty(2 * bins), np.empty(2 * bins)
    out_t[0::2], out_t[1::2] = time_s[starts], time_s[starts] + width / 2
    out_y[0::2], out_y[1::2] = lows, highs
    return out_t, out_y


def course(time_s: Array, values: Array, bins: int = 400) -> tuple[Array, Array]:
    """The mean of each of `bins` equal stretches, at its middle; a short series comes back as it
    is.
    """
    if len(time_s) <= 2 * bins:
        return time_s, values
    starts = np.linspace(0, len(time_s), bins, endpoint=False).astype(int)
    counts = np.diff(np.append(starts, len(time_s)))
    return np.add.reduceat(time_s, starts) / counts, np.add.reduceat(values, starts) / counts


def spread(time_s: Array, values: Array, bins: int = 400) -> tuple[Array, Array, Array]:
    """Middle, smallest and largest value of each of `bins` equal stretches."""
    bins = min(bins, len(time_s))
    starts = np.linspace(0, len(time_s), bins, endpoint=False).astype(int)
    counts = np.diff(np.append(starts, len(time_s)))
    return (
        np.add.reduceat(time_s, starts) / counts,
        np.fmin.reduceat(values, starts),
        np.fmax.reduceat(values, starts),
    )


def limits(*series: Array, share: float = 0.002, room: float = 0.08) -> tuple[float, float]:
    """Axis limits that hold all but the most extreme `share` of the values, with some room."""
    values = np.concatenate([one[np.isfinite(one)] for one in series]) if series else np.zeros(0)
    if not values.size:
        return 0.0, 1.0
    low, high = (float(level) for level in np.quantile(values, [share, 1.0 - share]))
    span = max(high - low, 1e-9 * max(abs(high), 1.0), 1e-12)
    return low - room * span, high + room * span


def busiest(time_s: Array, values: Array, width_s: float = 1.0) -> tuple[float, float]:
    """The stretch of `width_s` in which `values` change most from sample to sample: (start, end)
    [s].
    """
    if len(time_s) < 3 or time_s[-1] - time_s[0] <= width_s:
        return float(time_s[0]), float(time_s[-1])
    rows = max(round(width_s / float(np.median(np.diff(time_s)))), 1)
    total = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(values)))])
    start = int(np.argmax(total[rows:] - total[:-rows])) if len(total) > rows else 0
    return float(time_s[start]), float(time_s[min(start + rows, len(time_s) - 1)])


def thousands(unit: str, *series: Array) -> tuple[float, str]:
    """In what to show values of a `unit`, and its name: in thousands from a thousand on."""
    most = max((float(np.nanmax(np.abs(values))) for values in series if len(values)), default=0.0)
    return (THOUSAND, f"k{unit}") if most >= THOUSAND else (1.0, unit)
