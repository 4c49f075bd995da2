"""The compiled force residual of a rig: means of what the force misses, and exact derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.diagnosis.leg.plain_balance import (
    PlainRows,
    binned_columns,
    binned_error_n,
    is_plain,
)
from testbed.effects.terms import ForceTerms
from testbed.estimation.cylinder import stribeck_of
from testbed.recording.leg_model import Friction

WIDTH, BINS = 8, 30
NUMBERS = (
    "viscous_plus_n_s_m",
    "coulomb_plus_n",
    "stribeck_plus_n",
    "viscous_minus_n_s_m",
    "coulomb_minus_n",
    "stribeck_minus_n",
)
FRICTION = Friction(
    viscous_plus_n_s_m=2000.0,
    coulomb_plus_n=300.0,
    stribeck_plus_n=120.0,
    stribeck_speed_plus_m_s=0.01,
    viscous_minus_n_s_m=1500.0,
    coulomb_minus_n=260.0,
    stribeck_minus_n=90.0,
    stribeck_speed_minus_m_s=0.02,
)


def rows(friction: Friction = FRICTION, load_coefficient: float = 0.0) -> PlainRows:
    rng = np.random.default_rng(8)
    count = WIDTH * BINS
    speed = np.repeat(rng.uniform(0.01, 0.2, BINS) * rng.choice([-1.0, 1.0], BINS), WIDTH)
    return PlainRows(
        total_n=rng.uniform(2_000.0, 6_000.0, count),
        velocity_m_s=speed,
        reference_n=rng.uniform(1_000.0, 2_000.0, count),
        used=np.ones(count, dtype=bool),
        friction=stribeck_of(friction),
        coulomb_scale=rng.uniform(0.8, 1.2, count),
        coulomb_add_n=rng.uniform(0.0, 50.0, count),
        viscous_scale=rng.uniform(0.7, 1.0, count),
        load_coefficient=load_coefficient,
    )


def expected_error(given: PlainRows) -> np.ndarray:
    """Equation (5) written out."""
    speed, size = given.velocity_m_s, np.abs(given.velocity_m_s)
    side = np.where(speed > 0.0, "plus", "minus")

    def number(name: str, unit: str) -> np.ndarray:
        by_side = {way: getattr(FRICTION, f"{name}_{way}_{unit}") for way in ("plus", "minus")}
        return np.array([by_side[way] for way in side])

    fading = np.exp(-size / number("stribeck_speed", "m_s"))
    dry = given.coulomb_scale * number("coulomb", "n") + given.coulomb_add_n
    friction = given.viscous_scale * number("viscous", "n_s_m") * speed
    friction += np.sign(speed) * (dry + number("stribeck", "n") * fading)
    error = given.total_n - friction - given.reference_n
    return error.reshape(BINS, WIDTH).mean(axis=1)


def test_each_bin_is_the_mean_of_what_the_force_misses() -> None:
    assert binned_error_n(rows(), WIDTH) == pytest.approx(expected_error(rows()))


def test_a_sample_that_is_not_used_counts_for_nothing() -> None:
    given = rows()
    given.used[3] = False
    spoilt = given._replace(total_n=np.where(given.used, given.total_n, np.nan))
    assert np.isfinite(binned_error_n(spoilt, WIDTH)).all()
    assert binned_error_n(spoilt, WIDTH) == pytest.approx(binned_error_n(given, WIDTH))


def test_a_bin_without_a_sample_is_zero() -> None:
    given = rows()
    given.used[:WIDTH] = False
    assert binned_error_n(given, WIDTH)[0] == 0.0
    assert not binned_columns(given, WIDTH)[0].any()


@pytest.mark.parametrize("load_coefficient", [0.0, 0.05])
def test_columns_are_the_derivatives(load_coefficient: float) -> None:
    """The error is straight in these numbers, so differences are exact."""
    columns = binned_columns(rows(load_coefficient=load_coefficient), WIDTH)
    before = binned_error_n(rows(load_coefficient=load_coefficient), WIDTH)
    for k, name in enumerate(NUMBERS):
        more = replace_number(name, 10.0)
        after = binned_error_n(rows(more, load_coefficient), WIDTH)
        assert columns[:, k] == pytest.approx((after - before) / 10.0, abs=1e-9)


def replace_number(name: str, by: float) -> Friction:
    return FRICTION.model_copy(update={name: getattr(FRICTION, name) + by})


def test_numbers_of_the_one_way_do_not_move_the_other() -> None:
    columns, out = binned_columns(rows(), WIDTH), rows().velocity_m_s[::WIDTH] > 0.0
    assert not columns[out][:, 3:].any() and not columns[~out][:, :3].any()


@pytest.mark.parametrize(
    ("terms", "plain"),
    [
        ({}, True),
        ({"load_coefficient": 0.05}, True),
        ({"load_exponent": 2.0}, True),
        ({"load_coefficient": 0.05, "load_exponent": 2.0}, False),
        ({"presliding": (1e7, 1e3, 1.0)}, False),
        ({"narrow_bands": [(10.0, 100.0, 1)]}, False),
    ],
)
def test_what_has_a_memory_a_bend_or_a_band_goes_another_way(terms: dict, plain: bool) -> None:
    assert is_plain(replace(ForceTerms(80.0, 80.0), **terms)) is plain
