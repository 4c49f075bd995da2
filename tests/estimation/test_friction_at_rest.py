"""Friction at rest: memory, the oil's answer while the valve is shut, the valve's own pressure
changes.
"""

import numpy as np
import pytest

from testbed.estimation.cylinder import Cylinder, oil_springs
from testbed.estimation.live import friction_at_rest as at_rest

LOW, HIGH = -700.0, 800.0
DT_S = 1e-3


def run(piston_n, slides=0.0, push=0.0, ratio=1.2, start=None):
    s = at_rest.RestMemory.zeros()[0]
    if start is not None:
        at_rest.step(s, piston_n[0], start, start, 1.0, push, ratio, DT_S)
    return np.array([at_rest.step(s, p, LOW, HIGH, slides, push, ratio, DT_S) for p in piston_n])


def test_oil_of_both_chambers_is_as_stiff_as_computed_by_hand():
    # x = 0.25 m of 0.5: V_A = 1.362e-3, V_B = 1.048e-3;
    # 1.4e9 (1.481e-5 / 1.362e-3 + 6.718e-6 / 1.048e-3) = 24.2 MN/m
    cylinder = Cylinder.zeros()[0]
    cylinder["area_a"], cylinder["area_b"], cylinder["stroke"] = 3.8485e-3, 2.5918e-3, 0.5
    cylinder["dead_volume_a"] = cylinder["dead_volume_b"] = 4.0e-4
    cylinder["bulk_modulus"] = 1.4e9
    assert sum(oil_springs(2e6, 2e5, 0.25, cylinder)) == pytest.approx(24.2e6, rel=2e-3)


def test_air_softens_the_chamber_of_low_pressure_most():
    # 2 % of air: 1/beta + 0.02 / (1.4 p) (1 bar / p)^(1/1.4); at 21 bar absolute 7.73e-10 1/Pa, at
    # 3 bar 2.17e-8
    cylinder = Cylinder.zeros()[0]
    cylinder["area_a"], cylinder["area_b"], cylinder["stroke"] = 3.8485e-3, 2.5918e-3, 0.5
    cylinder["dead_volume_a"] = cylinder["dead_volume_b"] = 4.0e-4
    cylinder["bulk_modulus"], cylinder["air"] = 1.4e9, 0.02
    a, b = oil_springs(2e6, 2e5, 0.25, cylinder)
    assert a == pytest.approx(1.481e-5 / 1.362e-3 / (7.143e-10 + 7.73e-10), rel=2e-3)
    assert b == pytest.approx(6.718e-6 / 1.048e-3 / (7.143e-10 + 2.17e-8), rel=5e-3)


def test_first_value_is_the_middle_of_the_set():
    assert run(np.full(3, 5000.0))[0] == pytest.approx(50.0)


def test_friction_of_the_last_motion_is_remembered_and_fades():
    f = run(np.full(2000, 5000.0), start=HIGH)
    assert f[0] == pytest.approx(HIGH, rel=0.01)
    assert f[400] == pytest.approx(50.0 + 750.0 * np.exp(-1.0), rel=0.02)
    assert f[-1] == pytest.approx(50.0, abs=10.0)


def test_shut_valve_lets_the_seal_take_its_share_of_a_load_change():
    # a first small step of the piston force by -100 N bends the seal by + 1.2 * 100 N
    f = run(np.array([5000.0, 5000.0, *[4900.0] * 15]))
    assert f.max() - f[1] == pytest.approx(
        120.0, rel=0.25
    )  # some of it has faded before the smoothing lets all in


def test_open_valve_moves_friction_with_the_pressure_not_against_it():
    ramp = 5000.0 + np.concatenate([np.zeros(500), np.linspace(0.0, 600.0, 100)])
    f = run(ramp, push=1.0)
    assert f[-1] > f[499] + 300.0


def test_a_piston_about_to_slide_keeps_its_friction_when_the_pressure_falls_again():
    rise = 5000.0 + np.concatenate(
        [np.zeros(100), np.linspace(0.0, 900.0, 30), np.linspace(900.0, 0.0, 30)]
    )
    f = run(rise, push=1.0)
    assert f[-1] > 0.75 * f.max() > 300.0


@pytest.mark.parametrize("push", [0.0, 1.0, -1.0])
def test_friction_never_leaves_its_set(push):
    p = 5000.0 + 4000.0 * np.random.default_rng(0).standard_normal(2000).cumsum() / 10.0
    f = run(p, push=push)
    assert f.min() >= LOW and f.max() <= HIGH


def test_sliding_piston_has_the_friction_of_its_set_of_one():
    s = at_rest.RestMemory.zeros()[0]
    assert at_rest.step(s, 5000.0, 650.0, 650.0, 1.0, 0.0, 1.2, DT_S) == 650.0
