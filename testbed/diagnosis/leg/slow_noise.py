"""Noise of a bench's own sensors that their last digits do not show: the flicker of a force or
pressure channel, and what an analogue position sensor adds to the acceleration.

A transducer and its amplifier have white noise and, below a corner, flicker, whose power goes with
one over the frequency (Motchenbacher, Connelly: Low-Noise Electronic System Design, 1993, ch. 1).
Second differences see the white part alone. Both are read off the spectrum of short stretches in
which the piston slides one way: above ABOVE_HZ a motion has died out, and a reversal, whose step in
friction has power at every frequency, is not among them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from testbed.diagnosis.leg.evidence import Key
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import BIN, BLOCK_S, Series
from testbed.formats.arrays import Array
from testbed.recording.axis import Recording

STRETCH_S, FEWEST_STRETCHES = 0.25, 4
"""Length of a stretch, and how many tell a spectrum; they overlap by half."""
ABOVE_HZ, BELOW_HZ, BELOW_SHARE = 30.0, 500.0, 0.35
"""Band of a force's spectrum; the share is that of the sampling rate, below any filter's corner."""
POSITION_ABOVE_HZ, POSITION_BELOW_SHARE = 60.0, 0.45
"""Band of a position's, in which a mass of a bench moves by less than its sensor's noise."""
FEWEST_LINES = 5
BEND = 3
"""Degree of the course of a stretch that is taken for the motion's."""


@dataclass(frozen=True)
class Noise:
    """One-sided power densities at 1 Hz: `white`, in the square of the channel's unit a Hz, and
    `flicker`, in its square.
    """

    white: float
    flicker: float


def slow_noise_n(problem: Problem, recordings: Sequence[Recording]) -> dict[Key, float]:
    """Group of the force -> standard deviation in its bins of what flicker of force, pressures and
    load cell, and the position's noise as an acceleration, make of it, N; nothing of what the
    recording has no stretches to tell.
    """
    out: dict[Key, float] = {}
    for series, recording in zip(problem.series, recordings, strict=True):
        force, position = _force_n(series, recording), recording.position_m
        found = noise_of(force, series, recording, (ABOVE_HZ, BELOW_HZ, BELOW_SHARE))
        band = POSITION_ABOVE_HZ, np.inf, POSITION_BELOW_SHARE
        read = noise_of(position, series, recording, band)
        mass = series.signals.known.moving_mass_kg or 0.0
        hertz = np.geomspace(1.0 / BLOCK_S, 0.5 * series.full_rate_hz, 1000)
        passed = _passed(series, hertz)
        variance = 0.0
        if found is not None:
            variance += float(np.trapezoid(found.flicker / hertz * passed, hertz))
        if read is not None:
            inertia = (mass * (2.0 * np.pi * hertz) ** 2) ** 2
            density = read.white + read.flicker / hertz
            variance += float(np.trapezoid(density * inertia * passed, hertz))
        out["force", series.name] = float(np.sqrt(variance))
    return out


def noise_of(
    values: Array, series: Series, recording: Recording, band: tuple[float, float, float]
) -> Noise | None:
    """White noise and flicker of a channel, one value a row; None where the piston nowhere slides
    long enough, or the rate leaves no band.

    `band`: lowest and highest frequency, Hz, and the share of the sampling rate that is above any
    of them.
    """
    from scipy.optimize import nnls

    found = _spectrum(values, series, recording)
    if found is None:
        return None
    hertz, density = found
    low, high, share = band
    inside = (hertz >= low) & (hertz <= min(high, share * series.full_rate_hz)) & (density > 0.0)
    if inside.sum() < FEWEST_LINES:
        return None
    columns = np.column_stack([np.ones(inside.sum()), 1.0 / hertz[inside]])
    (white, flicker), _ = nnls(columns / density[inside, None], np.ones(inside.sum()))
    return Noise(float(white), float(flicker))


def _spectrum(values: Array, series: Series, recording: Recording) -> tuple[Array, Array] | None:
    """(frequencies, Hz; one-sided power density): the median over stretches, of a chi-square with
    two degrees of freedom ln 2 of its mean.
    """
    rows = round(STRETCH_S * series.full_rate_hz)
    slides = (series.trusted & series.clear).astype(np.float64)
    here = np.interp(recording.time_s, series.signals.time_s, slides) == 1.0
    along = np.concatenate([[0], np.cumsum(here)])
    starts = [
        start
        for start in range(0, len(values) - rows, max(rows // 2, 1))
        if along[start + rows] - along[start] == rows
    ]
    if len(starts) < FEWEST_STRETCHES or rows <= 2 * BEND:
        return None
    stretches = np.array([values[start : start + rows] for start in starts])
    course, _ = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, rows), BEND + 1))
    taper = np.hanning(rows)
    left = (stretches - stretches @ course @ course.T) * taper
    power = 2.0 * np.abs(np.fft.rfft(left, axis=1)) ** 2 / (series.full_rate_hz * np.sum(taper**2))
    density: Array = np.asarray(np.median(power, axis=0) / np.log(2.0), dtype=np.float64)
    hertz: Array = np.asarray(np.fft.rfftfreq(rows, 1.0 / series.full_rate_hz), dtype=np.float64)
    return hertz, density


def _passed(series: Series, hertz: Array) -> Array:
    """Share of a channel's power that its smoothing and a bin leave of each frequency."""
    smoothing = np.exp(-2.0 * (np.pi * series.width_s * hertz) ** 2) ** 2
    return np.asarray(smoothing * np.sinc(hertz * BIN / series.signals.rate_hz) ** 2)


def _force_n(series: Series, recording: Recording) -> Array:
    """What the sensors say of the external force before friction and mass, N, a value a row."""
    known, out = series.signals.known, np.zeros(len(recording.time_s))
    for values, area in (
        (recording.pressure_a_pa, known.area_a_m2),
        (recording.pressure_b_pa, -known.area_b_m2),
        (recording.actuator_force_n, 1.0),
        (recording.reference_force_n, -1.0),
    ):
        if values is not None:
            out = out + area * values
    return out
