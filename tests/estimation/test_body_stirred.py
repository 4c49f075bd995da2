"""How unsteadily the body goes, and what it leaves unknown of a moving foot: laws."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from testbed.estimation.live.body_records import BodyBelief
from testbed.estimation.live.body_stirred import BEGUN, SLIDING, Stirred, moving_variance, stir

DT = 5e-3


def stirred(felt: np.ndarray) -> Any:
    """What is remembered after specific forces (n, 3), m/s2."""
    state = Stirred.zeros()[0]
    for sample in felt:
        stir(sample, DT, state)
    return state


def felt(z: np.ndarray) -> np.ndarray:
    """On a slope, swaying along z."""
    return np.column_stack([np.full_like(z, -6.9), np.zeros_like(z), 6.9 + z])


def test_noise_faster_than_the_memory_has_its_own_variance() -> None:
    z = np.random.default_rng(5).normal(0.0, 0.3, 40_000)
    variances, state = [], Stirred.zeros()[0]
    for sample in felt(z):
        stir(sample, DT, state)
        variances.append(state.variance)
    assert np.mean(variances[1000:]) == pytest.approx(0.09, rel=0.06)


def test_what_is_steady_or_lasts_is_no_sway() -> None:
    assert stirred(felt(np.zeros(200))).variance == 0.0
    step = np.where(np.arange(400) < 200, 0.0, 1.0)
    assert stirred(felt(step[:205])).variance > 0.1
    assert stirred(felt(step)).variance < 1e-2  # a second later, ten times the memory


def test_a_missing_sample_teaches_nothing() -> None:
    z = np.sin(np.arange(100.0))
    gappy = np.insert(felt(z), 50, np.nan, axis=0)
    assert stirred(gappy).variance == stirred(felt(z)).variance


def test_a_foot_that_carries_errs_by_its_part_of_the_bodys_sway_and_one_in_the_air_does_not() -> (
    None
):
    body, state = BodyBelief.zeros()[0], Stirred.zeros()[0]
    body.steady_sd, body.body_mass, body.carries, state.variance = 40.0, 4000.0, 300.0, 0.04
    assert moving_variance(-50.0, 1.0, body, state) == 1600.0
    part = BEGUN * 1000.0 * 0.2
    assert moving_variance(7000.0, 1.0, body, state) == pytest.approx(1600.0 + part**2)
    assert moving_variance(150.0, 1.0, body, state) == pytest.approx(1600.0 + (0.5 * part) ** 2)


def test_a_piston_that_has_slid_for_long_errs_by_less_of_the_sway() -> None:
    body, state = BodyBelief.zeros()[0], Stirred.zeros()[0]
    body.body_mass, body.carries, state.variance = 4000.0, 300.0, 0.04
    sd = [math.sqrt(moving_variance(7000.0, begun, body, state)) for begun in (1.0, 0.5, 0.0)]
    assert sd == pytest.approx([BEGUN * 200.0, 0.5 * (BEGUN + SLIDING) * 200.0, SLIDING * 200.0])
