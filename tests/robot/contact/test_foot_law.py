"""One elastic foot: sticks as a spring, slides at its bound, never pulls, and knows its own
slope.
"""

from __future__ import annotations

import numpy as np
import pytest

from testbed.robot.contact.law import foot_reaction

COMPLIANCE = np.array(
    [[1.0e-7, 2.0e-8, 1.0e-8], [2.0e-8, 2.0e-7, 3.0e-8], [1.0e-8, 3.0e-8, 3.0e-7]]
)
"""Normal, two tangents, m/N."""


def reaction(
    strain: list[float], bound: float = 1.0e9, friction: float = 0.0
) -> tuple[np.ndarray, np.ndarray, bool, bool]:
    force, slope = np.empty(3), np.empty((3, 3))
    touches, slides = foot_reaction(COMPLIANCE, np.array(strain), bound, friction, force, slope)
    return force, slope, touches, slides


def test_a_foot_that_sticks_is_the_spring_of_its_compliance() -> None:
    strain = [1.0e-3, 2.0e-4, -1.0e-4]
    force, slope, touches, slides = reaction(strain)
    np.testing.assert_allclose(COMPLIANCE @ force, strain, rtol=1e-12)
    np.testing.assert_allclose(slope, np.linalg.inv(COMPLIANCE), rtol=1e-9)
    assert touches and not slides


def test_a_foot_that_slides_pulls_by_its_bound_along_what_is_left_of_its_strain() -> None:
    force, _, touches, slides = reaction([1.0e-3, 2.0e-3, -1.0e-3], bound=500.0)
    assert touches and slides
    assert np.hypot(force[1], force[2]) == pytest.approx(500.0)
    left = (np.array([1.0e-3, 2.0e-3, -1.0e-3]) - COMPLIANCE @ force)[1:]
    np.testing.assert_allclose(left / np.linalg.norm(left), force[1:] / 500.0, atol=1e-9)


def test_a_foot_that_is_lifted_never_pulls() -> None:
    force, slope, touches, _ = reaction([-1.0e-3, 0.0, 0.0], bound=0.0)
    assert not touches
    assert force.tolist() == [0.0, 0.0, 0.0] and not slope.any()


@pytest.mark.parametrize("bound", [400.0, 1.0e9], ids=["slides", "sticks"])
def test_its_slope_is_that_of_finite_differences(bound: float) -> None:
    strain, step = np.array([1.0e-3, 1.0e-3, -5.0e-4]), 1.0e-9
    slope = reaction(strain.tolist(), bound)[1]
    for k in range(3):
        ends = []
        for way in (-1.0, 1.0):
            moved = strain.copy()
            moved[k] += way * step
            ends.append(reaction(moved.tolist(), bound)[0])
        np.testing.assert_allclose(
            slope[:, k], (ends[1] - ends[0]) / (2 * step), rtol=1e-4, atol=1.0
        )


def test_friction_lets_the_bound_follow_the_normal_force() -> None:
    friction, strain, step = 0.5, np.array([1.0e-3, 2.0e-3, 0.0]), 1.0e-9
    bound = 3000.0
    for _ in range(80):  # the bound that the normal force gives
        bound = friction * reaction(strain.tolist(), bound)[0][0]
    slope = reaction(strain.tolist(), bound, friction)[1]
    ends = []
    for way in (-1.0, 1.0):
        moved, own = strain + np.array([way * step, 0.0, 0.0]), bound
        for _ in range(80):
            own = friction * reaction(moved.tolist(), own)[0][0]
        ends.append(reaction(moved.tolist(), own)[0])
    np.testing.assert_allclose(slope[:, 0], (ends[1] - ends[0]) / (2 * step), rtol=1e-3)
