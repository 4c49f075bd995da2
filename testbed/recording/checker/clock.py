"""The clock of a recording: times that stand still or run back, gaps, jumps, another rate than
declared.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from testbed.formats.arrays import Array, Flags
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.raw import Raw
from testbed.recording.checks import MINIMUM_SAMPLES, RATE_FACTOR

GAP_STEPS, GAP_S = 3.5, 0.02
"""Samples farther apart than so many usual steps, and than this, have a gap between them."""
LONG_GAP_S = 0.1
"""A longer gap is more than a hiccup of a logger that is not hard in time."""
RATE_OFF = 0.05
OTHER_UNIT = "is hardly in the declared unit"
"""Said of a clock of which nothing can be computed."""
JUMPED = 0.35
"""Where the position moved on by less than this share of what its speed asks for, only the clock
has jumped.
"""
UNEVEN = 0.05
"""Spread of the steps, as a share of the usual one, from which stamps may jitter."""
EVEN_SLOPE, KNOWN_TO = 0.4, 0.15
"""Stamps jitter where the position knows of less than this share of their unevenness (1: samples
were taken when their stamps say so), and that share is known to KNOWN_TO (standard error).
"""
SPEED_S = 0.05
"""Stretch each way over which the speed is read for that."""
BESIDE_S = 0.03
"""Stretch before and after a gap from which the speed is read."""


def rising(time_s: Array) -> Flags:
    """Rows (n,) whose time is finite and later than every row's before."""
    finite = np.isfinite(time_s)
    latest = np.maximum.accumulate(np.where(finite, time_s, -np.inf))
    out = finite.copy()
    out[1:] &= time_s[1:] > latest[:-1]
    return np.asarray(out)


def check_clock(raw: Raw) -> Iterator[Finding]:
    """Everything that is wrong with the times themselves."""
    time = raw.time_s
    if len(time) < MINIMUM_SAMPLES:
        yield Finding(
            "error",
            "time",
            "too few samples",
            f"{len(time)} rows",
            f"record at least {MINIMUM_SAMPLES}",
        )
        return
    lost = ~np.isfinite(time)
    if lost.any():
        row = int(np.argmax(lost))
        yield Finding(
            "error",
            "time",
            "time is not a number",
            f"{int(lost.sum())} rows, first row {row}",
            "leave these rows out",
        )
    with np.errstate(invalid="ignore"):  # infinite times are found above
        steps = np.diff(time)
    for bad, what, advice in (
        (steps < 0.0, "time runs backwards", "cut the recording there, or put its clock right"),
        (steps == 0.0, "time stands still: rows are doubled", "keep one of each pair of rows"),
    ):
        if bad.any():
            row = int(np.argmax(bad))
            yield Finding(
                "error",
                "time",
                what,
                f"{int(bad.sum())} times, first at row {row + 1}: {time[row]:.6g} s, "
                f"then {time[row + 1]:.6g} s",
                advice,
                float(time[row]),
                float(time[row + 1]),
            )
    yield from _rate(raw, steps)
    yield from _gaps(raw)
    yield from _jitter(raw)


def _jitter(raw: Raw) -> Iterator[Finding]:
    """Stamps that come early and late while the motion goes on evenly from row to row.

    Between two neighbours a position is ahead of their middle by speed times what its stamp is, or
    not at all where the stamp alone is.
    """
    time, (_, position) = raw.time_s, _moving_most(raw)
    if position is None or not (np.isfinite(time).all() and np.isfinite(position).all()):
        return
    steps = np.diff(time)
    usual = float(np.median(steps))
    rows = max(1, round(SPEED_S / usual)) if usual > 0.0 else len(time)
    if len(time) < 2 * rows + MINIMUM_SAMPLES or not (steps > 0.0).all():
        return
    inner = slice(rows - 1, len(time) - rows - 1)
    speed = (position[2 * rows :] - position[: -2 * rows]) / (time[2 * rows :] - time[: -2 * rows])
    regular = np.maximum(steps[:-1], steps[1:])[inner] < GAP_STEPS * usual
    ahead, moved = (_beside_the_middle(values)[inner][regular] for values in (time, position))
    asked = speed[regular] * ahead
    square = float(asked @ asked)
    if float(np.std(ahead)) < UNEVEN * usual or square == 0.0:
        return
    slope = float(asked @ moved) / square
    error = float(np.std(moved - slope * asked)) / np.sqrt(square)
    if slope < EVEN_SLOPE and error < KNOWN_TO:
        yield Finding(
            "warning",
            "time",
            "its stamps jitter: the motion goes on evenly from row to row",
            f"steps of {usual:.3g} s spread by {100 * float(np.std(ahead)) / usual:.2g} %, of which "
            f"the position knows {100 * slope:.2g} %",
            "number the samples by the logger's own rate instead",
        )


def _moving_most(raw: Raw) -> tuple[str, Array | None]:
    """Name and values of the position of an axis; of a robot, of the one that goes farthest."""
    if "position" in raw.series:
        return "position", raw.series["position"]
    way = {
        name: float(np.ptp(values))
        for name, values in raw.series.items()
        if name.startswith("position_") and np.isfinite(values).all()
    }
    farthest = max(way, key=lambda name: way[name], default="")
    return farthest, raw.series.get(farthest)


def _beside_the_middle(values: Array) -> Array:
    """By how much each of values (n,) is ahead of the middle of its neighbours, (n - 2,)."""
    return np.asarray(values[1:-1] - 0.5 * (values[2:] + values[:-2]))


def _rate(raw: Raw, steps: Array) -> Iterator[Finding]:
    forward = steps[steps > 0.0]
    if not forward.size:
        return
    found, declared = 1.0 / float(np.median(forward)), raw.header.sample_rate_hz
    if abs(found / declared - 1.0) > RATE_OFF:
        hopeless = not 1.0 / RATE_FACTOR <= found / declared <= RATE_FACTOR
        yield Finding(
            "error" if hopeless else "warning",
            "time",
            OTHER_UNIT if hopeless else "the rate is not the declared one",
            f"{found:.5g} Hz in the table, {declared:.5g} Hz declared",
            "put channels.time.unit right (ms?)" if hopeless else "put sample_rate_hz right",
        )


def _gaps(raw: Raw) -> Iterator[Finding]:
    """Gaps in one finding, clock jumps in another."""
    time = raw.time_s
    with np.errstate(invalid="ignore"):
        steps = np.diff(time)
    forward = steps[steps > 0.0]
    if not forward.size:
        return
    usual = float(np.median(forward))  # a clock of whole seconds stands still in most rows
    far = np.flatnonzero(steps > max(GAP_STEPS * usual, usual + GAP_S))
    jumps = [jump for jump in far if _only_the_clock(raw, int(jump), usual)]
    gaps = [jump for jump in far if jump not in jumps]
    for rows, what, advice in (
        (
            gaps,
            "samples are missing",
            "nothing is computed across them; more than these, record again",
        ),
        (
            jumps,
            "the clock jumps: the motion goes on as if no time had passed",
            "number the samples by the logger's own rate instead",
        ),
    ):
        if not rows:
            continue
        longest = max(rows, key=lambda k: steps[k])
        short = what.startswith("samples") and steps[longest] <= LONG_GAP_S
        yield Finding(
            "note" if short else "warning",
            "time",
            what,
            f"{len(rows)} times, longest {steps[longest]:.3g} s at t = {time[longest]:.6g} s "
            f"(usual step {usual:.3g} s)",
            advice,
            float(time[longest]),
            float(time[longest + 1]),
        )


def _only_the_clock(raw: Raw, row: int, usual_s: float) -> bool:
    """Whether the position at a long step goes on by one usual step only, though it moves at both
    sides: that of the axis which would have gone farthest meanwhile.
    """
    ways = []
    for name, position in raw.series.items():
        if name == "position" or name.startswith("position_"):
            ways += _way_over(raw, position, row, usual_s, raw.resolutions.get(name, 0.0))
    expected, travelled = max(ways, key=lambda way: abs(way[0]), default=(0.0, 0.0))
    return expected != 0.0 and travelled / expected < JUMPED


def _way_over(
    raw: Raw, position: Array, row: int, usual_s: float, count: float
) -> list[tuple[float, float]]:
    """How far a position (n,) should have gone in a long step after `row`, and how far it went,
    both beyond one usual step; nothing where its speeds at both sides do not tell. `count`: of its
    encoder.
    """
    beside = max(3, round(BESIDE_S / usual_s))
    before = slice(max(row - beside, 0), row + 1)
    after = slice(row + 1, row + 2 + beside)
    speeds = []
    for side in (before, after):
        time, place = raw.time_s[side], position[side]
        if (
            len(place) < 3
            or not np.isfinite(place).all()
            or (np.diff(time) > GAP_STEPS * usual_s).any()
            or time[-1] <= time[0]
        ):
            return []
        speeds.append((place[-1] - place[0]) / (time[-1] - time[0]))
    speed = 0.5 * (speeds[0] + speeds[1])
    step_s = raw.time_s[row + 1] - raw.time_s[row]
    expected = speed * (step_s - usual_s)
    if speeds[0] * speeds[1] <= 0.0 or abs(expected) <= max(3.0 * count, 1e-5):
        return []
    return [(float(expected), float(position[row + 1] - position[row] - speed * usual_s))]
