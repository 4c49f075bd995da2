"""Friction: the paper's (5) in steady sliding, true sticking below break-away, ageing; ends of the stroke."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from testbed.laws import columns as c
from testbed.laws.ends import end_force, extra_force, mean_ramp, share_above
from testbed.laws.friction import (
    bristle_step,
    dwell_step,
    friction_step,
    relax,
    steady_friction,
    stribeck_level,
)

K, D = 3e7, 1e4


def _axis() -> tuple[np.ndarray, np.ndarray]:
    p, s = np.zeros(c.AXIS_PARAMETERS), np.zeros(c.AXIS_STATES)
    p[[c.FC_POS, c.FS_POS, c.CS_POS, c.VISC_POS]] = 620.0, 180.0, 0.007, 5200.0
    p[[c.FC_NEG, c.FS_NEG, c.CS_NEG, c.VISC_NEG]] = 540.0, 160.0, 0.007, 4100.0
    p[[c.BRISTLE_K, c.BRISTLE_D, c.STROKE, c.DWELL_TIME]] = K, D, 0.5, 20.0
    return s, p


def test_stribeck_level_by_hand() -> None:
    assert stribeck_level(0.0, 620.0, 180.0, 0.007) == 800.0
    assert stribeck_level(0.007, 620.0, 180.0, 0.007) == pytest.approx(620.0 + 180.0 / math.e)
    assert steady_friction(0.1, 620.0, 180.0, 0.007, 5200.0) == pytest.approx(
        620.0 + 520.0, abs=1e-3
    )
    assert steady_friction(0.0, 620.0, 180.0, 0.007, 5200.0) == 0.0


@pytest.mark.parametrize("v", [-0.2, -0.004, 0.003, 0.05])
def test_steady_sliding_is_equation_5(v: float) -> None:
    s, p = _axis()
    for _ in range(400):
        force = friction_step(s, p, 0.25, v, 1e5, 1e5, 1.0, 0.0, 0.0, 1e-3)
    pos = (620.0, 180.0, 0.007, 5200.0) if v > 0 else (540.0, 160.0, 0.007, 4100.0)
    assert force == pytest.approx(steady_friction(v, *pos), rel=1e-4)


def test_stuck_bristle_is_a_spring_that_keeps_its_load() -> None:
    z, force = bristle_step(1e-5, 0.0, 1e-3, 800.0, K, D)
    assert (z, force) == (1e-5, 300.0)


@given(st.floats(-2e-5, 2e-5), st.floats(-0.5, 0.5), st.floats(1e-4, 1e-2))
def test_bristle_never_passes_its_level(z: float, v: float, dt: float) -> None:
    new, _ = bristle_step(z, v, dt, 800.0, K, D)
    assert K * abs(new) <= max(800.0, K * abs(z)) * (1 + 1e-9)


@given(st.floats(-2e-5, 2e-5), st.floats(-0.5, 0.5))
def test_two_half_steps_are_one_step(z: float, v: float) -> None:
    whole, mean = bristle_step(z, v, 1e-3, 800.0, K, D)
    half, first = bristle_step(z, v, 5e-4, 800.0, K, D)
    twice, second = bristle_step(half, v, 5e-4, 800.0, K, D)
    assert twice == pytest.approx(whole, rel=1e-6, abs=1e-15)
    assert 0.5 * (first + second) == pytest.approx(mean, rel=1e-5, abs=1e-3)


def test_relaxation_by_hand_and_its_series_meet() -> None:
    assert relax(1.0, 0.0, 1.0) == pytest.approx((1 / math.e, 1 - 1 / math.e))
    assert relax(1.0, 0.0, 0.01 - 1e-9) == pytest.approx(relax(1.0, 0.0, 0.01 + 1e-9), abs=1e-8)


def test_rest_ages_the_contact_and_sliding_renews_it() -> None:
    aged, _ = dwell_step(0.0, 0.15, 1 / 20.0, 0.0, 20.0)
    assert aged == pytest.approx(0.15 * (1 - 1 / math.e))
    worn, _ = dwell_step(aged, 0.15, 1 / 20.0, 0.1 * K / 620.0, 0.01)
    assert worn < 1e-5


def test_position_pressure_load_and_side_raise_the_coulomb_part() -> None:
    for column, change, kwargs in (
        (c.FR_POSITION, 0.1 * 0.4 * 620.0, {"x": 0.45}),
        (c.FR_PRESSURE, 6e-6 * 1.2e7, {"a": 6.1e6, "b": 6.1e6}),
        (c.FR_LOAD, 0.01 * 5e3, {"load": 5e3}),
        (c.FR_SIDE, 0.02 * 1e3, {"side": -1e3}),
    ):
        value = {c.FR_POSITION: 0.1, c.FR_PRESSURE: 6e-6, c.FR_LOAD: 0.01, c.FR_SIDE: 0.02}[column]
        forces = []
        for size in (0.0, value):
            s, p = _axis()
            p[column] = size
            for _ in range(200):
                forces_now = friction_step(
                    s,
                    p,
                    kwargs.get("x", 0.25),
                    0.2,
                    kwargs.get("a", 1e5),
                    kwargs.get("b", 1e5),
                    1.0,
                    kwargs.get("load", 0.0),
                    kwargs.get("side", 0.0),
                    1e-3,
                )
            forces.append(forces_now)
        assert forces[1] - forces[0] == pytest.approx(change, rel=1e-6)


def test_warm_oil_scales_the_viscous_part_alone() -> None:
    forces = []
    for warm in (1.0, 0.5):
        s, p = _axis()
        for _ in range(200):
            force = friction_step(s, p, 0.25, 0.2, 1e5, 1e5, warm, 0.0, 0.0, 1e-3)
        forces.append(force)
    assert forces[0] - forces[1] == pytest.approx(0.5 * 5200.0 * 0.2)


def test_ramp_means_by_hand() -> None:
    assert mean_ramp(-1.0, 1.0) == 0.25
    assert mean_ramp(2.0, 4.0) == 3.0
    assert mean_ramp(-2.0, -1.0) == 0.0
    assert share_above(-1.0, 3.0) == 0.75


def _ends() -> np.ndarray:
    _, p = _axis()
    p[[c.CUSHION_LENGTH, c.CUSHION_D, c.STOP_K, c.STOP_D]] = 0.03, 6e4, 5e7, 3e4
    return p


def test_cushion_brakes_the_approach_only() -> None:
    p = _ends()
    assert end_force(p, 0.25, -0.1, 1e-3) == 0.0
    assert end_force(p, 0.015, -0.1, 1e-9) == pytest.approx(6e4 * 0.1 * 0.5, rel=1e-6)
    assert end_force(p, 0.015, +0.1, 1e-9) == 0.0
    assert end_force(p, 0.485, +0.1, 1e-9) == pytest.approx(-6e4 * 0.1 * 0.5, rel=1e-6)


def test_stop_is_a_spring_that_never_pulls() -> None:
    p = _ends()
    assert end_force(p, -1e-4, 0.0, 1e-3) == pytest.approx(5e3)
    assert end_force(p, 0.5001, 0.0, 1e-3) == pytest.approx(-5e3)
    assert end_force(p, -1e-6, 0.5, 1e-9) == 0.0  # leaving faster than the spring follows


def test_mean_end_force_is_the_mean_of_its_parts() -> None:
    p = _ends()
    for x, v in ((2e-4, -0.4), (0.0305, -0.8), (0.4998, 0.5), (-3e-4, 0.6)):
        parts = [end_force(p, x + v * 1e-5 * k, v, 1e-5) for k in range(100)]
        assert end_force(p, x, v, 1e-3) == pytest.approx(np.mean(parts), rel=1e-9, abs=1e-6)


def test_extra_forces_by_hand() -> None:
    _, p = _axis()
    p[[c.SPRING_K, c.SPRING_REST]] = 1e4, 0.2
    assert extra_force(p, 0.3, 0.0, 0.0, 1e-3) == pytest.approx(-1e3)
    _, p = _axis()
    p[[c.PERIODIC_N, c.PERIODIC_W]] = 100.0, 2 * math.pi * 25.0
    assert extra_force(p, 0.3, 0.0, 0.0, 0.04) == pytest.approx(0.0, abs=1e-9)  # a whole period
    assert extra_force(p, 0.3, 0.0, 0.0, 0.02) == pytest.approx(100.0 * 2 / math.pi)
    _, p = _axis()
    p[[c.XCUSHION_K, c.XCUSHION_START]] = 1e5, 0.1
    assert extra_force(p, 0.06, 0.0, 0.0, 1e-3) == pytest.approx(4e3)
    assert extra_force(p, 0.2, 0.0, 0.0, 1e-3) == 0.0
