"""Figures that benchmarks state: root mean squares, intervals of shares and rates."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike


def rms(values: ArrayLike) -> float:
    """Root mean square, in their unit."""
    return float(np.sqrt(np.mean(np.square(values))))


def wilson(hits: int, of: int, z: float = 1.959964) -> list[float] | None:
    """95 % interval of a share (Wilson's score); None of nothing."""
    if of == 0:
        return None
    share, shrink = hits / of, 1.0 + z * z / of
    middle = (share + z * z / (2 * of)) / shrink
    half = z / shrink * math.sqrt(share * (1 - share) / of + z * z / (4.0 * of * of))
    return [max(0.0, middle - half), min(1.0, middle + half)]


def poisson(count: int, hours: float) -> list[float] | None:
    """Exact 95 % interval of a rate an hour from `count` events; None of no time."""
    from scipy.stats import chi2

    if hours <= 0.0:
        return None
    low = float(chi2.ppf(0.025, 2 * count)) / 2.0 if count else 0.0
    return [low / hours, float(chi2.ppf(0.975, 2 * count + 2)) / 2.0 / hours]
