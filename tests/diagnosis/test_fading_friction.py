"""Dry friction that vanishes with speed stands for another law, as a drag by the speed squared."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.benchmarks.diagnosis.bench_rigs import make_bench
from testbed.diagnosis.leg.base_models import declared, fit_base
from testbed.diagnosis.leg.bench_probabilities import BenchCalibration, BenchSigns, distribution
from testbed.diagnosis.leg.bench_probabilities import calibration as of_benches
from testbed.diagnosis.leg.evidence import Evidence, evidence
from testbed.diagnosis.leg.fading_friction import fading, fading_signs
from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.probabilities import answer
from testbed.diagnosis.leg.probabilities import calibration as of_legs
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import series_of
from testbed.estimation.leg.motion import signals_of
from testbed.recording.axis import Recording

SOUND = 16
"""A drive that lacks nothing."""


def _dragged(recording: Recording, drag_n: float) -> Recording:
    """The recording with a drag of this much at 0.2 m/s, growing with the square of the speed."""
    signals = signals_of(recording)
    velocity = np.interp(recording.time_s, signals.time_s, signals.velocity_m_s)
    force_n = recording.actuator_force_n
    assert force_n is not None
    return replace(
        recording, actuator_force_n=force_n + drag_n * velocity * np.abs(velocity) / 0.04
    )


def _fitted(drag_n: float) -> tuple[Problem, Fit, Evidence]:
    """The published model fitted on a drive with such a drag."""
    rig, _ = make_bench(SOUND)
    base = declared(rig)
    dragged = tuple(_dragged(recording, drag_n) for recording in rig.identify)
    problem = Problem(series_of(dragged, base.known), base, False)
    fit, _ = fit_base(problem)
    return problem, fit, evidence(problem, fit)


@pytest.fixture(scope="module")
def sound() -> tuple[Problem, Fit, Evidence]:
    return _fitted(0.0)


def test_a_sound_drives_dry_friction_stays_and_the_one_that_imitates_a_drag_goes(
    sound: tuple[Problem, Fit, Evidence],
) -> None:
    assert fading(*sound) < 0.3
    assert fading(*_fitted(30.0)) > 1.0


def test_what_fades_is_the_friction_at_slow_speeds_over_that_at_fast_ones(
    sound: tuple[Problem, Fit, Evidence],
) -> None:
    """40 N that go with 0.05 m/s over 10 N that stay, the one way; nothing goes the other way."""
    problem, fit, left = sound
    still = fit.at.friction.model_copy(
        update={
            "coulomb_plus_n": 10.0,
            "stribeck_plus_n": 40.0,
            "stribeck_speed_plus_m_s": 0.05,
            "coulomb_minus_n": 10.0,
            "stribeck_minus_n": 0.0,
        }
    )
    fit = replace(fit, at=replace(fit.at, friction=still))
    quiet = replace(left, rms=dict.fromkeys(left.rms, 0.0))
    velocity = np.concatenate(
        [one.signals.velocity_m_s[one.trusted & one.clear] for one in problem.series]
    )
    slow, fast = np.quantile(velocity[velocity > 3e-3], (0.1, 0.9))
    dry = [10.0 + 40.0 * np.exp(-speed / 0.05) for speed in (slow, fast)]
    stays = 0.5 * (dry[1] + 10.0)
    assert fading(problem, fit, quiet) == pytest.approx(np.log1p((dry[0] - dry[1]) / stays))
    shifted = still.model_copy(update={"coulomb_plus_n": 20.0, "coulomb_minus_n": 0.0})
    pushed = replace(fit, at=replace(fit.at, friction=shifted))  # by a constant force of 10 N
    assert fading(problem, pushed, quiet) == pytest.approx(fading(problem, fit, quiet))
    noisy = replace(left, rms=dict.fromkeys(left.rms, 1e4))
    assert fading(problem, fit, noisy) == pytest.approx(0.0, abs=4e-3)


@pytest.mark.parametrize("weights", [of_legs().fading, of_benches().fading])
def test_the_weights_of_fading_are_the_odds_of_two_half_normal_distributions(
    weights: dict[str, float],
) -> None:
    usual, imitated, odds = 0.3, 1.5, 0.03
    assert weights["one"] == pytest.approx(np.log(odds * usual / imitated), abs=1e-3)
    assert weights["square"] == pytest.approx(0.5 / usual**2 - 0.5 / imitated**2, abs=1e-3)
    assert answer(fading_signs(0.4), weights) < 0.02  # a third goes: a seal's
    assert answer(fading_signs(1.4), weights) > 0.95  # three quarters: no friction


def test_a_bench_whose_friction_fades_is_said_to_have_something_without_a_name() -> None:
    never = BenchCalibration({"one": -30.0}, 0.1, 0.0, of_benches().fading)
    signs = BenchSigns(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, ())
    assert distribution(signs, (), never)[()] > 0.99
    assert distribution(replace(signs, fading=1.5), (), never)[("unnamed",)] > 0.95
