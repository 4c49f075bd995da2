"""Noise of sensors: what rounding leaves of a channel, and what a filter may not gain by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic_bench import bench

from testbed.diagnosis.leg.base_models import declared
from testbed.diagnosis.leg.noise import given_back, grain, rounding_left
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import series_of
from testbed.effects import by_name
from testbed.effects.active import Active
from testbed.estimation.leg.balance import corrected, piston_force_n
from testbed.recording.axis import Rig

STEP = 2.0


def test_rounding_stays_where_a_signal_is_slow_and_averages_out_under_noise() -> None:
    slow = 40.0 * np.sin(np.arange(20_000) / 3000.0)
    rounded = np.round(slow / STEP) * STEP
    assert grain(slow) == 0.0 and rounding_left(slow) == 0.0
    assert grain(rounded) == STEP
    assert rounding_left(rounded) == pytest.approx(STEP / np.sqrt(12.0), rel=0.05)
    noise = 0.6 * STEP * np.random.default_rng(1).standard_normal(slow.size)
    assert rounding_left(np.round((slow + noise) / STEP) * STEP) < 0.02 * STEP


def test_a_line_that_rings_gains_nothing_by_the_noise_that_it_damps() -> None:
    """Pressure B is nothing but noise: what is left after the filter counts as what it was."""
    recordings, known = bench([0.01, 0.03])
    known = known.model_copy(update={"rod_m": 0.5 * known.bore_m, "stroke_m": 0.1})
    rng = np.random.default_rng(2)
    runs = tuple(
        replace(
            recording,
            header=recording.header.model_copy(update={"known": known}),
            pressure_b_pa=2e4 * rng.standard_normal(len(recording)),
            pressure_a_pa=np.full(len(recording), 1e5),
        )
        for recording in recordings
    )
    series = series_of(runs, known)
    problem = Problem(series, declared(Rig("bench", runs[0].folder, runs, ())), False)
    line = by_name("sensor.line_b")
    effect = Active(line, line.complete({"natural_frequency": 11.0, "damping": 0.1}))

    def force(effects: tuple[Active, ...]) -> np.ndarray:
        parts = [piston_force_n(corrected(one.signals, effects)) for one in series]
        pairs = zip(parts, series, strict=True)
        return np.concatenate(
            [one.binned(part - np.mean(part), one.trusted & one.clear)[0] for part, one in pairs]
        )

    there = problem.layout["force"].count > 0
    plain, filtered = (force(some)[there].std() for some in ((), (effect,)))
    assert filtered < 0.97 * plain
    judged = given_back(problem, (effect,), force((effect,)))[there].std()
    assert judged == pytest.approx(plain, rel=0.03)
