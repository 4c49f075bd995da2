"""An interval of 90 % and its standard deviation are two ways of telling one thing."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.formats.intervals import Z90, interval90, sd_of


def test_the_interval_holds_ninety_of_a_hundred_draws() -> None:
    low, high = interval90(5.0, 2.0)
    draws = np.random.default_rng(4).normal(5.0, 2.0, 40_000)
    assert ((draws > low) & (draws < high)).mean() == pytest.approx(0.9, abs=0.005)


def test_there_and_back_numbers_and_arrays() -> None:
    assert sd_of(interval90(-3.0, 0.7)) == pytest.approx(0.7)
    low, high = np.array([0.0, 1.0]), np.array([2.0 * Z90, 1.0])
    np.testing.assert_allclose(sd_of((low, high)), [1.0, 0.0])
