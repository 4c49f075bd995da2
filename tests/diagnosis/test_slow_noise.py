"""A sensor's flicker is read off its spectrum while the piston slides one way: white noise has
none, reversals of friction make none, and in a fit's bins it is as large as it is there.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_bench import bench

from testbed.diagnosis.leg.base_models import declared
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import BLOCK_S, series_of
from testbed.diagnosis.leg.slow_noise import (
    ABOVE_HZ,
    BELOW_HZ,
    BELOW_SHARE,
    noise_of,
    slow_noise_n,
)
from testbed.recording.axis import Recording, Rig

BAND = ABOVE_HZ, BELOW_HZ, BELOW_SHARE
FLICKER_N2, WHITE_N2_HZ = 2.0, 0.02
SPEEDS = (0.01, 0.02, 0.04, 0.08)


def flicker(rows: int, rate_hz: float, strength: float, seed: int) -> np.ndarray:
    """Noise of the one-sided density `strength` / f, (rows,)."""
    rng = np.random.default_rng(seed)
    hertz = np.fft.rfftfreq(rows, 1.0 / rate_hz)
    density = np.divide(strength, hertz, out=np.zeros_like(hertz), where=hertz > 0.0)
    lines = rng.standard_normal((2, len(hertz)))
    return np.fft.irfft(
        (lines[0] + 1j * lines[1]) / np.sqrt(2.0) * np.sqrt(0.5 * density * rate_hz * rows), rows
    )


def made(strength: float, white: float = WHITE_N2_HZ) -> Recording:
    """A bench whose load cell has this flicker and this white noise; friction turns round with the
    motion.
    """
    recordings, _ = bench(SPEEDS)
    one = recordings[0]
    assert one.reference_force_n is not None and one.pressure_a_pa is not None
    rows, rate_hz = len(one.time_s), one.header.sample_rate_hz
    rng = np.random.default_rng(5)
    smooth_pa = 1e5 + 2e4 * np.sin(one.time_s)
    speed = one.position_m[10:] - one.position_m[:-10]  # over more than a count
    speed = np.pad(speed, 5, mode="edge")
    noise_n = np.sqrt(0.5 * white * rate_hz) * rng.standard_normal(rows)
    noise_n += flicker(rows, rate_hz, strength, 6)
    area = one.header.known.area_a_m2  # type: ignore[union-attr]
    cell_n = area * smooth_pa - 80.0 * np.sign(speed) + noise_n
    return replace(one, pressure_a_pa=smooth_pa, reference_force_n=cell_n)


def found_in(recording: Recording) -> tuple[Problem, float, float]:
    """(problem of that recording, white density, flicker)."""
    base = declared(Rig("bench", Path(), (recording,), ()))
    problem = Problem(series_of([recording], base.known), base, False)
    assert recording.reference_force_n is not None
    told = noise_of(-recording.reference_force_n, problem.series[0], recording, BAND)
    assert told is not None
    return problem, told.white, told.flicker


@pytest.mark.parametrize("strength", [0.5 * FLICKER_N2, 4.0 * FLICKER_N2])
def test_flicker_and_white_noise_are_told_apart(strength: float) -> None:
    _, white, told = found_in(made(strength))
    assert told == pytest.approx(strength, rel=0.35)
    assert white == pytest.approx(WHITE_N2_HZ, rel=0.5)


def test_white_noise_and_reversals_of_friction_make_no_flicker() -> None:
    _, white, told = found_in(made(0.0, white=FLICKER_N2))
    assert white == pytest.approx(FLICKER_N2, rel=0.1)
    assert told < 0.1 * ABOVE_HZ * FLICKER_N2


def test_in_bins_it_is_as_large_as_what_is_left_of_a_perfect_model() -> None:
    recording = made(FLICKER_N2, white=1e-4)
    problem, _, _ = found_in(recording)
    (told,) = slow_noise_n(problem, [recording]).values()
    (series,) = problem.series
    noise = flicker(len(recording.time_s), recording.header.sample_rate_hz, FLICKER_N2, 6)
    smoothed = replace(recording, reference_force_n=noise)
    (reference,) = (one.reference_n for one in series_of([smoothed], problem.base.known))
    assert reference is not None
    binned, count = series.binned(reference, series.trusted & series.clear)
    per_block = round(BLOCK_S * series.signals.rate_hz / 3)
    used = binned[count > 0]
    course = np.vander(np.arange(per_block) / per_block, 2)  # what is slower than a block
    parts = [used[k : k + per_block] for k in range(0, len(used) - per_block, per_block)]
    left = [part - course @ np.linalg.lstsq(course, part, rcond=None)[0] for part in parts]
    there = float(np.sqrt(np.mean(np.square(left))))
    assert told == pytest.approx(there, rel=0.35)
