"""Motions of the reference rigs stay within the stroke, at speeds a bench can drive."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.benchmarks.reference_leg.rigs import DURATION_S, IDENTIFY, VERIFY, target
from testbed.benchmarks.reference_leg.sensors import _line, _sensor_effects

STROKE_M, GROUND_M, RATE_HZ = 0.5, 0.35, 500.0


@pytest.mark.parametrize("kind", DURATION_S)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_motion_stays_within_the_stroke_and_is_its_seeds(kind: str, seed: int) -> None:
    made = [
        target(kind, 10.0, RATE_HZ, STROKE_M, GROUND_M, np.random.default_rng(number))
        for number in (seed, seed, seed + 10)
    ]
    assert made[0].shape == (5000,)
    assert made[0].min() > 0.0 and made[0].max() < STROKE_M
    assert np.array_equal(made[0], made[1]) and not np.array_equal(made[0], made[2])


def test_a_press_goes_onto_the_ground_and_off_again() -> None:
    x = target("press", 40.0, RATE_HZ, STROKE_M, GROUND_M, np.random.default_rng(3))
    on = x > GROUND_M
    assert 0.2 < on.mean() < 0.95 and np.count_nonzero(np.diff(on.astype(int))) >= 4
    assert x.max() < GROUND_M + 0.005


def test_every_motion_is_used() -> None:
    assert set(IDENTIFY) | set(VERIFY) == set(DURATION_S)


def test_a_line_passes_what_is_slow_and_delays_what_is_fast() -> None:
    t = np.arange(0.0, 2.0, 1e-3)
    still = np.full_like(t, 4e6)
    np.testing.assert_allclose(_line(still, 1e3, 20.0, 0.8), still, rtol=1e-9)
    fast = np.sin(2.0 * np.pi * 20.0 * t)
    seen = _line(fast, 1e3, 20.0, 0.8)[1000:]
    assert np.abs(seen).max() == pytest.approx(1.0 / 1.6, rel=0.03)  # 1 / (2 zeta) at resonance


@pytest.mark.parametrize(
    ("hidden", "a", "b"),
    [
        ({"sensor.gain_a:gain": 0.1}, 1.1e6, 2e6),
        ({"sensor.gain_b:gain": -0.1}, 1e6, 1.8e6),
        ({"sensor.drift_a:drift": 100.0}, 1e6 + 1e3, 2e6),
    ],
)
def test_a_sensors_effect_is_its_formula(hidden: dict[str, float], a: float, b: float) -> None:
    t = np.array([0.0, 10.0])
    found = _sensor_effects(t, np.full(2, 1e6), np.full(2, 2e6), np.full(2, 25.0), 1.0, hidden)
    assert found[0][-1] == pytest.approx(a) and found[1][-1] == pytest.approx(b)
