"""Slopes and shifts of a recorded series have known answers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import shift

from testbed.estimation.leg.motion import later, slope

RATE_HZ = 250.0
TIME_S = np.arange(400) / RATE_HZ
SERIES = np.cumsum(np.random.default_rng(4).normal(size=400))


def test_the_slope_of_a_ramp_is_its_slope_up_to_both_ends() -> None:
    assert slope(3.0 - 0.7 * TIME_S, RATE_HZ) == pytest.approx(-0.7, abs=1e-11)


@pytest.mark.parametrize("share_of_rate", [0.02, 0.06, 0.125])
def test_the_slope_of_a_sine_is_true_to_an_eighth_of_the_rate(share_of_rate: float) -> None:
    w = 2.0 * np.pi * share_of_rate * RATE_HZ
    found = slope(np.sin(w * TIME_S), RATE_HZ)[3:-3]
    assert found == pytest.approx(w * np.cos(w * TIME_S)[3:-3], abs=3e-3 * w)


@pytest.mark.parametrize("samples", [0.3, 1.0, 2.7, -0.4, -3.0])
def test_a_series_comes_later_as_its_cubic_spline_does(samples: float) -> None:
    by_scipy = shift(SERIES, samples, order=3, mode="nearest")
    assert later(SERIES, samples) == pytest.approx(by_scipy, abs=1e-10)


def test_by_whole_samples_it_is_moved_and_stays_what_it_was_at_its_end() -> None:
    assert later(SERIES, 3.0)[3:] == pytest.approx(SERIES[:-3], abs=1e-10)
    assert later(SERIES, 3.0)[:3] == pytest.approx(SERIES[0], abs=1e-10)
    assert later(SERIES, -2.0)[-2:] == pytest.approx(SERIES[-1], abs=1e-10)


def test_back_again_a_smooth_series_is_what_it_was() -> None:
    smooth = np.sin(2.0 * np.pi * 3.0 * TIME_S)
    there_and_back = later(later(smooth, 0.4), -0.4)
    assert there_and_back[5:-5] == pytest.approx(smooth[5:-5], abs=1e-4)
