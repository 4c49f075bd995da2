"""Expected loads against the truth on a few stands; intervals, combinations and heights by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shipped import MACHINE, shipped_model, slope_gravity

from testbed.benchmarks.climbs.expected_loads import QUARTER_N, scores, stand, table
from testbed.benchmarks.climbs.stands import (
    fixed_combinations,
    heights_under_load,
    load_interval_n,
    loads_of_measured_posture,
)
from testbed.robot.loads.foot_loads import ExpectedLoads, Footing, internal_force_of

STANCE = np.tile([0.0, 0.2, 0.25], 4)
LEVEL = slope_gravity(0.0)


def _ground(expected: ExpectedLoads, posture: np.ndarray) -> Footing:
    return Footing(heights_m=heights_under_load(expected, posture))


@pytest.mark.slow
def test_a_few_stands_of_the_evaluation_keep_its_bounds() -> None:
    cases = [case for number in range(5) if (case := stand(number)) is not None]
    found = scores(cases)
    assert found["cases"] >= 4
    assert found["known_rms"] < 0.03
    assert found["combination_rms"] < 0.03
    assert all(sum(case.true_n) > 0.05 * QUARTER_N for case in cases)
    # What the footings err by is there: it parts the diagonals by hundreds of newtons.
    signs = np.array([1.0, -1.0, -1.0, 1.0])
    assert np.median([abs(signs @ case.true_n) for case in cases]) > 400.0
    assert [row[1] for row in table(found).rows][1].startswith("RMS error of the fixed")


def test_the_twist_has_no_sum_and_no_moment_and_the_combinations_are_all_the_rest() -> None:
    feet = np.array([[1.4, 1.0], [1.2, -1.0], [-1.0, 1.1], [-1.2, -1.0]])
    internal, fixed = internal_force_of(feet), fixed_combinations(feet)
    np.testing.assert_allclose([internal.sum(), *(internal @ feet)], 0.0, atol=1e-12)
    np.testing.assert_allclose(fixed @ internal, 0.0, atol=1e-12)
    np.testing.assert_allclose(fixed @ fixed.T, np.eye(3), atol=1e-12)


def test_a_foot_that_reaches_lower_under_load_carries_what_the_ground_gives_for_it() -> None:
    """Rigid joints, ground of 1e8 N/m: a foot 0.04 mm lower than the plane of the others is a
    internal of a quarter.
    """
    expected = ExpectedLoads(shipped_model(), MACHINE)
    even = loads_of_measured_posture(expected, STANCE, LEVEL, _ground(expected, STANCE))
    lower = STANCE.copy()
    lower[2] += 4.0e-5
    found = loads_of_measured_posture(expected, lower, LEVEL, _ground(expected, lower))
    np.testing.assert_allclose(
        found.normal_n - even.normal_n, 1e8 * 1e-5 * np.array([1, -1, -1, 1]), rtol=1e-3
    )
    assert found.normal_n.sum() == pytest.approx(4000.0 * 9.81, rel=1e-6)


def test_reserves_of_a_measured_posture_count_the_joints_give() -> None:
    expected = ExpectedLoads(shipped_model(), MACHINE)
    found = loads_of_measured_posture(expected, STANCE, LEVEL, _ground(expected, STANCE))
    plain = expected.solve(STANCE, LEVEL)
    np.testing.assert_allclose(found.reserve_n, plain.reserve_n, rtol=0.02)
    assert found.unloads_first == plain.unloads_first


def test_the_interval_is_the_internal_force_of_the_footing_and_grows_with_it() -> None:
    expected = ExpectedLoads(shipped_model(), MACHINE)
    (low, high), (lower, higher) = (
        load_interval_n(expected, STANCE, LEVEL, sd) for sd in (1.0e-4, 2.0e-4)
    )
    centre = expected.solve(STANCE, LEVEL).vertical_load_n
    assert np.all(low < centre) and np.all(centre < high)
    assert np.all(lower < low) and np.all(higher > high)
    stiff = 1.0 / (expected.oil.joint_compliance(STANCE)[2] + expected.ground_compliance_m_n)
    by_hand = 1.645 * math.hypot(1.0e-4, 150.0 / stiff) * stiff * 0.5
    np.testing.assert_allclose(high - centre, by_hand, rtol=0.05)


def test_oil_at_low_pressure_is_softer() -> None:
    expected = ExpectedLoads(shipped_model(), MACHINE)
    low, high = (
        expected.oil.joint_compliance(STANCE, (np.full(12, p), np.full(12, p))) for p in (5e5, 6e6)
    )
    assert np.all(low > 1.3 * high)
