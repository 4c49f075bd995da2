"""What the rows of every recording must satisfy, of one axis or of the whole robot, and pressures
in Pa.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from testbed.errors import InputError
from testbed.formats.arrays import Array, Flags
from testbed.recording.axis_header import Channel

MINIMUM_SAMPLES = 50
"""Fewer rows than this carry no velocity worth the name."""
RATE_FACTOR = 100.0
"""A table whose rate differs from the declared one by more is not in seconds."""
BEYOND_RANGE = 0.2
"""A transducer may read beyond its declared range by this share of it: its calibration is not the
nominal one.
"""
MOST_PA = 1.0e9
"""No hydraulic machine holds more (ten times the strongest presses'); for channels that declare no
range.
"""
STROKES, LONGEST_M = 2.0, 20.0
"""Positions that span more strokes than this, or more than any cylinder where no stroke is
declared, are not in metres."""


def usual_step_s(time_s: Array) -> float:
    """Usual distance of two samples, s, as the first ones of times (n,) tell it: what is computed
    with it changes with no sample that comes later.
    """
    return float(np.median(np.diff(time_s[:MINIMUM_SAMPLES])))


def check_time(
    time: Array, sample_rate_hz: float, file: Path, declared_in: Path, field: str = "time"
) -> None:
    """Refuse times (n,), s, that are few, do not rise, or are far from the declared rate."""
    if len(time) < MINIMUM_SAMPLES:
        raise InputError(
            f"too few samples: {len(time)}", file=file, allowed=f"at least {MINIMUM_SAMPLES}"
        )
    check_finite("time", time, time, file)
    steps = np.diff(time)
    if (steps <= 0).any():
        row = int(np.argmax(steps <= 0)) + 1
        how = "goes backwards" if steps[row - 1] < 0 else "stands still"
        raise InputError(
            f"time {how} at row {row}: {time[row - 1]:.6g} s, then {time[row]:.6g} s", file=file
        )
    found_hz = 1.0 / float(np.median(steps))
    if not 1.0 / RATE_FACTOR <= found_hz / sample_rate_hz <= RATE_FACTOR:
        raise InputError(
            f"the samples come at {found_hz:.3g} Hz, the header declares {sample_rate_hz:.6g} Hz: "
            f"column {field!r} is hardly in s",
            file=declared_in,
            field="sample_rate_hz",
            value=sample_rate_hz,
            allowed=f"within a factor of {RATE_FACTOR:g} of the table's rate",
        )


def check_span(
    field: str, unit: str, position_m: Array, stroke_m: float | None, declared_in: Path
) -> None:
    """Refuse positions (n,), m, that span far more than the declared stroke, or than any: they are
    in another unit.
    """
    span = float(np.ptp(position_m))
    most = LONGEST_M if stroke_m is None else STROKES * stroke_m
    beside, allowed = "no cylinder is so long", f"at most {LONGEST_M:g} m"
    if stroke_m is not None:
        beside, allowed = f"the stroke is {stroke_m:g} m", f"at most {STROKES:g} strokes"
    if span > most:
        raise InputError(
            f"the positions span {span:.6g} {unit}, {beside}",
            file=declared_in,
            field=field,
            value=unit,
            allowed=f"{allowed}; positions in m",
        )


def check_finite(name: str, values: Array, time: Array, file: Path) -> None:
    """Refuse a column (n,) with a value that is not finite, naming its first row and time."""
    bad = ~np.isfinite(values)
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError(
            f"column {name!r} is not finite at row {row} (t = {time[row]:.6g} s): {values[row]} "
            f"({int(bad.sum())} such rows)",
            file=file,
        )


def check_pressure(channel: Channel, values: Array, time: Array, file: Path) -> None:
    """Refuse pressures (n,), Pa, that the declared transducer cannot say, or no hydraulic machine
    holds.
    """
    low, high = (-MOST_PA, MOST_PA) if channel.range_pa is None else channel.range_pa
    beyond = BEYOND_RANGE * (high - low)
    bad = (values < low - beyond) | (values > high + beyond)
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError(
            f"column {channel.column!r} is {values[row]:.4g} Pa at row {row} (t = {time[row]:.6g} s), beyond its "
            f"transducer ({int(bad.sum())} such rows)",
            file=file,
            allowed=f"{low:g} to {high:g} Pa, and {100 * BEYOND_RANGE:g} % of that beyond",
        )


def pressure(
    channel: Channel | None, raw: Array | None, time: Array, file: Path
) -> tuple[Array | None, Flags | None]:
    """Pressure (n,) in Pa through its calibration, and where the sensor is at the end of its range.

    Raises InputError, naming `file`, for pressures far beyond that range.
    """
    if channel is None or raw is None:
        return None, None
    values = in_pa(channel, raw)
    check_pressure(channel, values, time, file)
    if channel.range_pa is None:
        return values, None
    low, high = channel.range_pa
    # The clip happens before the voltage is rounded to the converter's step: 0.1 % of the range is
    # tolerance.
    margin = 1e-3 * (high - low)
    at_end = values >= high - margin
    if low != 0.0:
        at_end |= values <= low + margin
    return values, at_end


def in_pa(channel: Channel, raw: Array) -> Array:
    """A pressure channel's column (n,) in Pa: as it is, or through the calibration from V."""
    calibration = channel.calibration
    return raw if calibration is None else calibration.pressure_pa(raw)
