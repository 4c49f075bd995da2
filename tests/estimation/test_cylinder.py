"""One cylinder: pressures, force and friction (5) as a value, a set, columns and a recording."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from testbed.estimation.cylinder import (
    RATIO_MOST,
    Conditions,
    Cylinder,
    Sensor,
    break_away_over,
    extra_friction,
    friction_parts,
    friction_set,
    friction_terms,
    friction_value,
    piston_force_n,
    place_factor,
    seal_ratio,
    stribeck_of,
    thinning_by_warmth,
    true_pressure,
    valve_direction,
)
from testbed.recording.leg_model import Friction

FRICTION = Friction(
    viscous_plus_n_s_m=4000.0,
    coulomb_plus_n=500.0,
    stribeck_plus_n=200.0,
    stribeck_speed_plus_m_s=0.01,
    viscous_minus_n_s_m=3000.0,
    coulomb_minus_n=400.0,
    stribeck_minus_n=100.0,
    stribeck_speed_minus_m_s=0.02,
)
AS_DECLARED = Conditions(1.0, 0.0, 1.0, 0.0)
RECORD = stribeck_of(FRICTION)[0]


def test_a_reading_is_freed_of_zero_drift_and_gain() -> None:
    sensor = Sensor.of(gain=0.02, zero=3e4, drift=100.0)
    assert true_pressure(1.02 * 5e6 + 3e4 + 100.0 * 60.0, sensor, 60.0) == pytest.approx(5e6)
    assert true_pressure(5e6, Sensor.of(), 60.0) == 5e6


def test_the_rods_side_counts_against_the_pistons() -> None:
    assert piston_force_n(2e6, 1e6, 4e-3, 3e-3) == pytest.approx(5000.0)


@pytest.mark.parametrize("v", [0.03, -0.03, 1e-4, -0.5])
def test_columns_times_the_numbers_are_the_value(v: float) -> None:
    sense = "plus" if v > 0.0 else "minus"
    numbers = [
        getattr(FRICTION, f"viscous_{sense}_n_s_m"),
        getattr(FRICTION, f"coulomb_{sense}_n"),
        getattr(FRICTION, f"stribeck_{sense}_n"),
    ]
    speed = np.array([abs(v)])
    terms = friction_terms(speed, getattr(FRICTION, f"stribeck_speed_{sense}_m_s"))
    value = friction_value(v, RECORD, AS_DECLARED)
    assert math.copysign(1.0, v) * (terms @ numbers)[0] == pytest.approx(value, rel=1e-12)


def test_columns_of_many_stribeck_speeds_come_at_once() -> None:
    speed, grid = np.array([0.01, 0.02, 0.04]), np.array([0.005, 0.01])
    terms = friction_terms(speed, grid[:, None])
    assert terms.shape == (2, 3, 3)
    for k, stribeck_speed in enumerate(grid):
        np.testing.assert_array_equal(terms[k], friction_terms(speed, stribeck_speed))


def test_at_rest_friction_is_all_between_both_break_away_forces_and_sliding_it_is_one() -> None:
    assert friction_set(0.0, 0.0, 0.0, RECORD, AS_DECLARED) == (-500.0, 700.0)
    value = friction_value(0.02, RECORD, AS_DECLARED)
    assert friction_set(0.02, 1.0, 1.0, RECORD, AS_DECLARED) == (value, value)
    low, high = friction_set(0.02, 1.0, 0.5, RECORD, AS_DECLARED)
    assert (low, high) == pytest.approx((0.5 * (value - 500.0), 0.5 * (value + 700.0)))


def test_conditions_scale_the_dry_part_thin_the_viscous_and_age_the_break_away() -> None:
    now = Conditions(1.5, 60.0, 0.5, 0.1)
    dry = 1.5 * 500.0 + 60.0
    expected = 4000.0 * 0.5 * 0.01 + dry + (200.0 + 0.1 * dry) * math.exp(-1.0)
    assert friction_value(0.01, RECORD, now) == pytest.approx(expected)
    assert friction_value(0.0, RECORD, now) == 0.0


def test_over_a_recording_it_is_what_it_is_sample_by_sample() -> None:
    velocity = np.array([0.03, -0.03, 0.002, -0.2])
    factor, extra, thinning = np.full(4, 1.2), np.full(4, 30.0), np.array([1.0, 0.8, 0.6, 0.4])
    level, viscous = friction_parts(velocity, FRICTION, factor, extra, thinning)
    each = [
        friction_value(v, RECORD, Conditions(1.2, 30.0, thin, 0.0))
        for v, thin in zip(velocity, thinning, strict=True)
    ]
    assert viscous + np.sign(velocity) * level == pytest.approx(np.array(each), rel=1e-12)
    low, high = break_away_over(FRICTION, np.array([1.0, 2.0]), np.array([0.0, -2000.0]))
    assert low.tolist() == [-500.0, 0.0] and high.tolist() == [700.0, 0.0]  # seals never push


def cylinder(**numbers: float) -> Any:
    return Cylinder.of(stroke=0.5, **numbers)


def test_place_warmth_pressure_and_loads_change_it_as_declared() -> None:
    c = cylinder(
        position_slope=0.4,
        pressure_coefficient=1e-5,
        load_coefficient=0.02,
        side_coefficient=0.1,
        viscosity_rate=0.03,
        viscosity_reference=40.0,
    )
    assert [place_factor(c, x) for x in (0.0, 0.25, 0.5)] == pytest.approx([0.8, 1.0, 1.2])
    assert thinning_by_warmth(c, 50.0) == pytest.approx(math.exp(-0.3))
    assert thinning_by_warmth(cylinder(), 50.0) == 1.0
    assert extra_friction(c, 8e6, 1e4, 300.0) == pytest.approx(80.0 + 200.0 + 30.0)
    assert extra_friction(c, 8e6, -1e4, 300.0) == pytest.approx(80.0 + 30.0)  # pulled: no guides


def test_seals_behind_soft_oil_count_no_more_than_a_bound() -> None:
    c = cylinder(area_a=4e-3, area_b=2e-3, dead_volume_a=1e-3, dead_volume_b=5e-4, bulk_modulus=1e9)
    # x = 0: V_A = 1e-3, V_B = 1.5e-3: 16e-6 / 1e-12 + 4e-6 / 1.5e-12 = 18.67 MN/m
    c.seal_stiffness = 9.333e6
    assert seal_ratio(1e6, 1e6, 0.0, c) == pytest.approx(0.5, rel=1e-4)
    c.seal_stiffness = 1e9
    assert seal_ratio(1e6, 1e6, 0.0, c) == RATIO_MOST


def test_an_open_valve_pushes_one_way_and_one_in_its_dead_band_none() -> None:
    assert [valve_direction(u, 0.03) for u in (-0.5, -0.029, 0.0, 0.029, 0.03)] == [
        -1.0,
        0,
        0,
        0,
        1.0,
    ]
