"""Robust scatter and weights: what far rows may do to a fit."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.estimation.friction.posterior import (
    HUBER,
    correlation_inflation,
    huber_weights,
    scatter,
)
from testbed.recording.axis_header import Calibration


def test_the_scatter_of_a_normal_is_its_standard_deviation_whatever_a_tenth_does() -> None:
    normal = np.random.default_rng(1).normal(0.0, 30.0, 20_000)
    assert scatter(normal) == pytest.approx(30.0, rel=0.02)
    normal[::10] *= 1000.0
    assert scatter(normal) == pytest.approx(30.0, rel=0.2)
    assert scatter(np.zeros(10)) > 0.0


def test_beyond_the_corner_a_row_pulls_as_one_at_the_corner() -> None:
    residual = np.array([0.0, 1.0, HUBER, 2.0 * HUBER, -10.0 * HUBER])
    weights = huber_weights(residual, 1.0)
    assert weights[:3].tolist() == [1.0, 1.0, 1.0]
    assert np.abs(weights * residual)[3:] == pytest.approx(HUBER)
    np.testing.assert_allclose(huber_weights(5.0 * residual, 5.0), weights)


def test_rows_that_follow_one_another_count_as_fewer() -> None:
    rng = np.random.default_rng(3)
    white = rng.normal(size=20_000)
    assert correlation_inflation(white) == pytest.approx(1.0, abs=0.1)
    walk = np.empty_like(white)
    walk[0], keep = white[0], 0.5
    for k in range(1, len(white)):
        walk[k] = keep * walk[k - 1] + white[k]
    assert correlation_inflation(walk) == pytest.approx((1.0 + keep) / (1.0 - keep), rel=0.1)
    assert correlation_inflation(np.ones(50)) == 1.0


def test_volts_and_pressures_are_two_ways_of_telling_one_reading() -> None:
    calibration = Calibration(k_pa_per_v=5e6, a=1.02, b=-0.5)
    volts = np.array([0.5, 2.5, 4.5])
    pressure_pa = calibration.pressure_pa(volts)
    assert pressure_pa[1] == pytest.approx(5e6 * (1.02 * 2.5 - 0.5))
    np.testing.assert_allclose(calibration.volts(pressure_pa), volts, rtol=1e-12)
