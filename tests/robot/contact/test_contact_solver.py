"""Elastic, unilateral feet in equilibrium with a wrench: answers known by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from testbed.robot.contact.solver import Feet, solve_contacts

Array = np.ndarray[Any, np.dtype[np.float64]]
RECTANGLE = np.array([[1.2, 0.9, 0.0], [1.2, -0.9, 0.0], [-1.2, 0.9, 0.0], [-1.2, -0.9, 0.0]])
"""fl, fr, rl, rr, m."""
TWIST = np.array([1.0, -1.0, -1.0, 1.0])
STIFFNESS_N_M = 1.0e7
AXES = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Contact axes: normal up, then x and y."""
WEIGHT_N = 40_000.0


def solve(
    load: list[float],
    feet: Array = RECTANGLE,
    friction: float = 0.7,
    heights: Array | None = None,
    active: list[bool] | None = None,
) -> Any:
    """Forces, touches, slides, missing wrench, forces per height, forces per load."""
    count = len(feet)
    maps = np.array(
        [np.vstack([AXES.T, np.array([np.cross(foot, axis) for axis in AXES]).T]) for foot in feet]
    )
    found, *rest = solve_contacts(
        np.array(load),
        Feet(
            np.ascontiguousarray(maps),
            np.tile(np.eye(3) / STIFFNESS_N_M, (count, 1, 1)),
            np.zeros(count) if heights is None else heights,
            np.ones(count, dtype=bool) if active is None else np.array(active),
        ),
        np.full(count, friction),
    )
    return found.forces, found.touches, found.slides, *rest


def test_a_weight_above_the_middle_is_borne_in_quarters() -> None:
    forces, touches, slides, missing, *_ = solve([0.0, 0.0, -WEIGHT_N, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(forces[:, 0], WEIGHT_N / 4.0, rtol=1e-8)
    np.testing.assert_allclose(forces[:, 1:], 0.0, atol=1e-6)
    assert touches.all() and not slides.any()
    np.testing.assert_allclose(missing, 0.0, atol=1e-2)


def test_three_feet_bear_by_their_levers_whatever_they_are_made_of() -> None:
    """Statically determinate: the loads are the barycentric coordinates of where the weight
    acts.
    """
    share = np.array([0.5, 0.3, 0.2])
    at = share @ RECTANGLE[:3]
    moment = np.cross(at, [0.0, 0.0, -WEIGHT_N])
    forces, *_ = solve([0.0, 0.0, -WEIGHT_N, *moment], RECTANGLE[:3])
    np.testing.assert_allclose(forces[:, 0], share * WEIGHT_N, rtol=1e-6)


def test_a_foot_that_stands_higher_twists_the_loads_by_a_quarter_of_its_stiffness() -> None:
    load = [0.0, 0.0, -WEIGHT_N, 0.0, 0.0, 0.0]
    *_, per_height, _ = solve(load)
    np.testing.assert_allclose(
        per_height[:, 0, :], STIFFNESS_N_M / 4.0 * np.outer(TWIST, TWIST), rtol=1e-5, atol=1.0
    )
    forces, *_ = solve(load, heights=np.array([1e-3, 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(forces[:, 0], WEIGHT_N / 4.0 + 2500.0 * TWIST, rtol=1e-5)


def test_a_foot_never_pulls_and_one_that_may_not_touch_bears_nothing() -> None:
    low = np.array([-10e-3, 0.0, 0.0, 0.0])
    load = [0.0, 0.0, -WEIGHT_N, 0.0, 0.0, 0.0]
    forces, touches, *_ = solve(load, heights=low)
    assert not touches[0] and touches[1:].all()
    np.testing.assert_allclose(forces[:, 0], WEIGHT_N * np.array([0.0, 0.5, 0.5, 0.0]), atol=2.0)
    absent, *_ = solve(load, active=[False, True, True, True])
    np.testing.assert_allclose(absent[:, 0], forces[:, 0], atol=2.0)


@pytest.mark.parametrize(("pull_share", "slide"), [(0.69, False), (0.80, True)])
def test_feet_hold_a_pull_up_to_friction_times_load_and_the_rest_is_missing(
    pull_share: float, slide: bool
) -> None:
    forces, _, slides, missing, *_ = solve(
        [pull_share * WEIGHT_N, 0.0, -WEIGHT_N, 0.0, 0.0, 0.0], friction=0.7
    )
    held = min(pull_share, 0.7) * WEIGHT_N
    assert bool(slides.all()) is slide
    assert -forces[:, 1].sum() == pytest.approx(held, rel=1e-6)
    # the support's sign: it pushes back what the feet do not hold
    assert missing[0] == pytest.approx(pull_share * WEIGHT_N - held, abs=2e-2 + 1e-6 * WEIGHT_N)
    np.testing.assert_array_less(
        np.linalg.norm(forces[:, 1:], axis=1), 0.7 * forces[:, 0] * (1.0 + 1e-6)
    )


@pytest.mark.parametrize("component", range(6))
def test_the_slope_by_the_load_is_that_of_finite_differences(component: int) -> None:
    load = np.array([3000.0, 1000.0, -WEIGHT_N, 2000.0, -3000.0, 500.0])
    step = np.zeros(6)
    step[component] = 1.0
    per_load = solve(list(load))[5]
    after, before = (solve(list(load + sign * step))[0] for sign in (1.0, -1.0))
    np.testing.assert_allclose(per_load[:, :, component], (after - before) / 2.0, atol=1e-5)
