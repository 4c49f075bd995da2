"""The step of a channel's values against the declared one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from testbed.formats.arrays import Array
from testbed.recording.axis_header import Header
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.raw import REFERENCE, Raw

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
            field, given, unit = _as_declared(raw, name)
            yield Finding(
                "warning",
                name,
                "has another resolution than declared",
                f"steps of {given * found / declared:.3g} {unit} in the table, {given:.3g} {unit} declared",
                f"put {field} right: the smallest step, {unit}",
            )


def _as_declared(raw: Raw, name: str) -> tuple[str, float, str]:
    """The field that declares a channel's resolution, its value and unit as they stand there."""
    if name == REFERENCE and isinstance(raw.header, Header) and raw.header.reference_force:
        cell = raw.header.reference_force
        return f"{REFERENCE}.resolution", cell.resolution or 0.0, cell.unit or "N"
    channel = raw.header.channels[name]
    return f"channels.{name}.resolution", channel.resolution or 0.0, channel.unit


def _made_of(levels: Array, step: float) -> bool:
    """Whether differences of values are whole numbers of a step, but for a few."""
    off = np.abs(levels / step - np.round(levels / step))
    return bool(np.quantile(off, 0.9) < NEAR_WHOLE)
