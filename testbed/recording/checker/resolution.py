"""The step of a channel's values against the declared one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from testbed.formats.arrays import Array
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.raw import Raw

SAME_RESOLUTION = 0.6, 1.6
"""Factors between which a found resolution is the declared one."""
NEAR_WHOLE = 0.1
"""Share of a step by which nine in ten differences of whole steps are off at most."""


def check_resolution(raw: Raw) -> Iterator[Finding]:
    """A step of the values that is not the declared one."""
    for name, declared in raw.resolutions.items():
        levels = np.diff(np.unique(raw.series[name]))
        levels = levels[levels > 1e-6 * declared]
        if levels.size < 10:
            continue
        found = float(np.quantile(levels, 0.1))
        if _made_of(levels, declared) and not any(
            _made_of(levels, k * declared) for k in (2, 3, 5)
        ):
            continue  # a fast channel skips counts
        if not SAME_RESOLUTION[0] < found / declared < SAME_RESOLUTION[1]:
            yield Finding(
                "warning",
                name,
                "has another resolution than declared",
                f"steps of {found:.3g} in the table, {declared:.3g} declared",
                f"put channels.{name}.resolution right",
            )


def _made_of(levels: Array, step: float) -> bool:
    """Whether differences of values are whole numbers of a step, but for a few."""
    off = np.abs(levels / step - np.round(levels / step))
    return bool(np.quantile(off, 0.9) < NEAR_WHOLE)
