"""What further experiment would tell two hypotheses apart, and that motion as a table."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from testbed.effects import by_name
from testbed.formats.table import write_columns
from testbed.recording.known import Known

FAST_FROM, FAST_M = 0.5, 0.006
"""Share of the motion after which small fast sinusoids come on top, and their amplitude."""
STEPS_UNTIL = 0.25
"""Share of it that has steps."""


def experiments(names: Iterable[str]) -> list[tuple[str, str]]:
    """(name, the motion that shows it alone) for the names of an ambiguous group."""
    motions = [(name, by_name(name).telling_motion) for name in names]
    return [(name, motion) for name, motion in motions if motion]


def write_motion(path: Path, known: Known, seconds: float = 60.0, rate_hz: float = 100.0) -> None:
    """A motion that parts most groups: slow strokes, small fast sinusoids and steps; columns `t` s,
    `position` m.

    Raises InputError for an ending other than .csv or .parquet, or a place that cannot be written.
    """
    stroke = known.stroke_m or 0.5
    time_s = np.arange(round(seconds * rate_hz)) / rate_hz
    phase = time_s / seconds
    slow = 0.5 + 0.3 * (2.0 / np.pi) * np.arcsin(np.sin(2.0 * np.pi * 3.0 * phase))
    fast = np.where(phase > FAST_FROM, FAST_M, 0.0) * np.sin(
        2.0 * np.pi * (1.0 + 3.0 * phase) * time_s
    )
    steps = 0.05 * np.sign(np.sin(2.0 * np.pi * time_s / 7.0)) * (phase < STEPS_UNTIL)
    write_columns(path, {"t": time_s, "position": stroke * np.clip(slow + steps, 0.1, 0.9) + fast})
