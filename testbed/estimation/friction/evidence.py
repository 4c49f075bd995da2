"""What recordings say about friction: one row for every few hundredths of a second in which the
piston slides.

A row is a speed and the force that is left of the balance without friction,
    y = pA A_A - pB A_B + m (g cos(inclination) - a) - F_ref = F_f(v),
with F_ref = 0 in the air. Rows lie further apart than the smoothing reaches, so that their errors
are independent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from testbed.effects.terms import Signals
from testbed.errors import InputError
from testbed.estimation.leg.balance import piston_force_n
from testbed.estimation.leg.gaps import in_gaps
from testbed.estimation.leg.motion import signals_of
from testbed.formats.arrays import Array, Flags
from testbed.formats.records import SET
from testbed.recording.axis import Recording
from testbed.recording.known import Known

BESIDE_SATURATED = 61
"""Samples around a saturated one that are left out with it."""
MOST_SATURATED = 0.5
"""Share of a recording beyond which a clipped sensor says nothing."""
STUCK_WAY_M = 5e-3
"""Way of the piston over which no live pressure stays the same to the last bit."""


SMOOTHING_S = 0.008
ROW_S = 0.032
"""Four standard deviations of the smoothing: the Gaussian's correlation has fallen to 2 %."""
SLIDING_M_S = 1.5e-3
"""Slower than this a piston may stick between two counts of the encoder."""
REVERSAL_S = 0.04
"""Samples nearer than this to a rest or a change of direction are left out (E)."""
MINIMUM_ROWS = 40


@dataclass(frozen=True)
class Evidence:
    """Rows (m,): signed speed m/s, force left over N, acceleration m/s2, pressures Pa, number of
    the recording.

    A pressure that was not recorded is 0.
    """

    velocity_m_s: Array
    force_n: Array
    acceleration_m_s2: Array
    pressure_a_pa: Array
    pressure_b_pa: Array
    recording: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.velocity_m_s)


def gather(recordings: Sequence[Recording], known: Known) -> Evidence:
    """Rows of all recordings together. Raises InputError naming the recording that cannot serve,
    and why.
    """
    parts = [_rows(recording, known, index) for index, recording in enumerate(recordings)]
    evidence = Evidence(
        *(
            np.concatenate([getattr(part, field) for part in parts])
            for field in Evidence.__dataclass_fields__
        )
    )
    if len(evidence) < MINIMUM_ROWS:
        raise InputError(
            f"the piston hardly moves: {len(evidence)} stretches of {ROW_S:g} s above {SLIDING_M_S * 1e3:g} mm/s",
            file=recordings[0].folder.parent,
            allowed=f"at least {MINIMUM_ROWS}",
        )
    return evidence


def _rows(recording: Recording, known: Known, number: int) -> Evidence:
    check_chambers(recording)
    check_alive(recording)
    seen = seen_in(recording, known)
    signals, pick = seen.signals, seen.rows(recording)
    force = piston_force_n(signals) + seen.inertia_n - seen.reference_n
    chambers = [
        np.zeros_like(force) if pressure is None else pressure
        for pressure in (signals.pressure_a_pa, signals.pressure_b_pa)
    ]
    in_a, in_b = (chamber[pick] for chamber in chambers)
    speed, acceleration = seen.velocity_m_s[pick], seen.acceleration_m_s2[pick]
    return Evidence(speed, force[pick], acceleration, in_a, in_b, np.full(pick.size, number))


@dataclass(frozen=True)
class Seen:
    """A recording smoothed and on an even grid: m/s, m/s2, N, each (n,)."""

    signals: Signals
    velocity_m_s: Array
    acceleration_m_s2: Array
    reference_n: Array
    inertia_n: Array
    """m (g cos(inclination) - a) of what is declared to move."""

    def rows(self, recording: Recording, sliding: bool = True) -> NDArray[np.intp]:
        """Places of the rows, ROW_S apart: while the piston slides, or all along."""
        time_s, rate_hz = self.signals.time_s, self.signals.rate_hz
        good = unsaturated(recording, time_s) & ~in_gaps(recording.time_s, time_s)
        if sliding:
            good &= steadily_sliding(self.velocity_m_s, rate_hz)
        every = max(1, round(ROW_S * rate_hz))
        return np.flatnonzero(good & (np.arange(len(good)) % every == 0))


def seen_in(recording: Recording, known: Known) -> Seen:
    """What a recording with a reference force shows of motion and forces."""
    signals = signals_of(recording, known, SMOOTHING_S)
    # not the truncated Gaussian's derivative: its gain is 0.1 % low, ten times what hundreds of
    # rows can see
    velocity = np.gradient(signals.position_m) * signals.rate_hz
    acceleration = np.gradient(velocity) * signals.rate_hz
    reference = smoothed_reference(recording, signals.time_s)
    mass = known.moving_mass_kg or 0.0
    inertia = mass * (known.gravity_along_axis_m_s2 - acceleration)
    return Seen(signals, velocity, acceleration, reference, inertia)


CLOSES = 0.3
"""Share of a load cell's force that friction may leave unexplained; a turned sign leaves more than
all of it.
"""


def check_closes(residual_n: float, recordings: Sequence[Recording]) -> None:
    """Refuse recordings on a load cell whose forces do not add up, whatever the friction."""
    cells = [
        recording.reference_force_n
        for recording in recordings
        if recording.reference_force_n is not None and not recording.is_free
    ]
    if not cells:
        return
    size = float(np.sqrt(np.mean(np.concatenate(cells) ** 2)))
    if residual_n > CLOSES * size:
        raise InputError(
            f"the force balance leaves {residual_n:.4g} N unexplained beside {size:.4g} N on the load cell: "
            "a force, a pressure or the position has the wrong sign or scale (testbed check says which)",
            file=recordings[0].folder.parent,
        )


def check_opposes(velocity_m_s: Array, force_n: Array, place: Path | None = None) -> None:
    """Refuse rows in which friction would drive the piston instead of braking it: a sign is turned
    round.

    Judged by its power. A constant force (a weight, a zero) helps one way what it takes the other,
    and is taken out; inertia gives back what it takes. A sensor behind a slow line lags what makes
    the piston fast, which looks like power put in: what friction is as a rule has to drive the
    piston, too.
    """
    way = np.sign(velocity_m_s)
    out_n, in_n = (float(np.median(force_n[way == side])) for side in (1.0, -1.0))
    constant, usual_n = 0.5 * (out_n + in_n), 0.5 * (out_n - in_n)
    braking_n = float(np.mean((force_n - constant) * velocity_m_s) / np.mean(np.abs(velocity_m_s)))
    if braking_n < 0.0 and usual_n < 0.0:
        raise InputError(
            f"the force balance leaves {braking_n:.4g} N of friction, which would drive the piston: "
            "a force, a pressure or the position has the wrong sign (testbed check says which)",
            file=place,
        )


def smoothed_reference(recording: Recording, time_s: Array) -> Array:
    """The reference force smoothed like the other channels, on their grid, N."""
    from testbed.estimation.leg.motion import smooth

    force_n = recording.known_force_n()
    if not force_n.any():
        return np.zeros_like(time_s)
    even = np.interp(time_s, recording.time_s, force_n)
    rate = (len(time_s) - 1) / float(time_s[-1] - time_s[0])
    return smooth(even, max(SMOOTHING_S * rate, 1.2))


def steadily_sliding(velocity: Array, rate_hz: float) -> Flags:
    """Fast enough, and not within REVERSAL_S of a sample that is not, a change of direction or an
    end.
    """
    from scipy.ndimage import binary_erosion

    reach = round(REVERSAL_S * rate_hz)
    fast = np.abs(velocity) > SLIDING_M_S
    fast[1:] &= velocity[1:] * velocity[:-1] > 0.0  # a quick reversal may have no slow sample
    return np.asarray(binary_erosion(fast, np.ones(2 * reach + 1), border_value=0), dtype=np.bool_)


def unsaturated(recording: Recording, time_s: Array) -> Flags:
    """Samples of the grid `time_s` with neither sensor at the end of its range within 30 samples,
    shape (n,).
    """
    bad = (recording.saturated_a | recording.saturated_b).astype(np.float64)
    if not bad.any():
        return np.ones(len(time_s), dtype=np.bool_)
    return np.asarray(
        np.interp(time_s, recording.time_s, np.convolve(bad, np.ones(BESIDE_SATURATED), "same"))
        < SET
    )


def check_chambers(recording: Recording) -> None:
    """Refuse a vertical leg that was recorded with chamber A alone."""
    if recording.rig == "vertical-leg" and recording.pressure_b_pa is None:
        raise InputError(
            "is missing: the balance of a vertical leg needs both chambers",
            file=recording.folder,
            field="channels.pressure_b",
        )


def check_rod(recording: Recording, known: Known) -> None:
    """Refuse a chamber B whose area nobody declares: it would count as large as A."""
    if recording.pressure_b_pa is not None and known.rod_m is None:
        raise InputError(
            "is missing: without it the area of chamber B is not known",
            file=recording.folder / "recording.yaml",
            field="known.rod_m",
            allowed="the rod's diameter, m, or no channel pressure_b",
        )


def check_alive(recording: Recording, moving: bool = True) -> None:
    """Refuse channels that say nothing: a constant position, a pressure that never changes or is
    clipped throughout.

    `moving` = False lets a position pass that stays (a leg pressed on a load cell). Raises
    InputError with the recording, the channel and where it happens.
    """
    if moving and np.ptp(recording.position_m) <= 2.0 * recording.position_resolution_m:
        raise InputError(
            f"the position stays at {recording.position_m[0]:.6g} m within two counts from "
            f"t = {recording.time_s[0]:.6g} s to {recording.time_s[-1]:.6g} s",
            file=recording.folder,
            field="position",
        )
    for name, values, saturated in (
        ("pressure_a", recording.pressure_a_pa, recording.saturated_a),
        ("pressure_b", recording.pressure_b_pa, recording.saturated_b),
    ):
        if values is None:
            continue
        if saturated.mean() > MOST_SATURATED:
            at = recording.time_s[int(np.argmax(saturated))]
            raise InputError(
                f"the sensor is at the end of its range in {100 * saturated.mean():.0f} % of the samples, "
                f"first at t = {at:.6g} s",
                file=recording.folder,
                field=name,
            )
        check_not_stuck(recording, name, values, saturated)


def check_not_stuck(recording: Recording, name: str, values: Array, saturated: Flags) -> None:
    """Refuse a pressure that repeats one value to the last bit for more than a second while the
    piston travels 5 mm.

    Raises InputError with the time at which the sensor froze.
    """
    change = np.flatnonzero(np.diff(values) != 0.0)
    starts = np.concatenate([[0], change + 1])
    stops = np.append(change, len(values) - 1)  # a gap behind the last of them is no repetition
    time, position = recording.time_s, recording.position_m
    for index in np.flatnonzero(time[stops] - time[starts] > 1.0):
        start, stop = starts[index], stops[index]
        if np.ptp(position[start : stop + 1]) > STUCK_WAY_M and not saturated[start]:
            raise InputError(
                f"the sensor is stuck at {values[start]:.6g} Pa from t = {time[start]:.6g} s to {time[stop]:.6g} s "
                f"while the piston moves",
                file=recording.folder,
                field=name,
            )
