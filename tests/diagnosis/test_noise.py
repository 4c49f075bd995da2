"""Noise of sensors: what rounding leaves of a channel, and what a filter may not gain by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic_bench import bench

from testbed.benchmarks.reference_leg.rigs import make_rig
from testbed.diagnosis.leg.base_models import declared
from testbed.diagnosis.leg.noise import (
    chamber_volumes_m3,
    flow_given_back,
    given_back,
    grain,
    rounding_left,
)
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import series_of
from testbed.effects import by_name
from testbed.effects.active import Active
from testbed.estimation.leg.balance import corrected, piston_force_n
from testbed.estimation.leg.motion import slope
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


def test_nor_does_it_gain_by_the_noise_that_it_damps_in_the_balance_of_the_oil() -> None:
    """An oil balance that holds nothing but the noise of pressure B, raised to what it was."""
    rig, _ = make_rig(12, "clean")
    base = declared(rig)
    problem = Problem(series_of(rig.identify, base.known), base, True)
    line = by_name("sensor.line_b")
    effect = Active(line, line.complete({"natural_frequency": 36.0, "damping": 0.1}))

    def of_oil(effects: tuple[Active, ...]) -> np.ndarray:
        parts = []
        for one in problem.series:
            assert one.pressure_noise_pa is not None
            noise_a, noise_b = one.pressure_noise_pa
            read = one.signals.with_(pressure_a_pa=noise_a, pressure_b_pa=noise_b)
            seen = corrected(read, effects)
            for volume, pressure in zip(
                chamber_volumes_m3(seen), (seen.pressure_a_pa, seen.pressure_b_pa), strict=True
            ):
                rate = slope(pressure, seen.rate_hz) / base.known.bulk_modulus_pa
                parts.append(one.binned(volume * rate, one.clear)[0])
        return np.concatenate(parts)

    layout = problem.layout["flow"]
    of_b = np.array([name.startswith("flow_b") for name, _ in layout.names])[layout.group]
    there = of_b & (layout.count > 0)
    plain, filtered = of_oil(()), of_oil((effect,))
    assert filtered[there].std() < 0.9 * plain[there].std()
    raised = flow_given_back(problem, (effect,), filtered)
    assert raised[there].std() == pytest.approx(plain[there].std(), rel=0.1)
    of_a = ~of_b & (layout.count > 0)
    assert raised[of_a] == pytest.approx(plain[of_a])
