"""Margins against hand-computed ones: a block on four feet, with and without ropes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from testbed.robot.stability import tipping_work_j, wrench_margin_n

FEET = np.array([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0]])
UP = np.tile([0.0, 0.0, 1.0], (4, 1))
WEIGHT = np.array([0.0, 0.0, -10.0, 0.0, 0.0, 0.0])
TOP = np.array([0.0, 0.0, 1.0])


def test_on_slippery_ground_friction_bounds_the_push_on_sticky_ground_tipping_does() -> None:
    assert wrench_margin_n(FEET, UP, 0.5, WEIGHT, TOP) == pytest.approx(0.5 * 10.0, rel=1e-3)
    # Weight at half the width 1, push at height 1: the far feet leave at a push of one weight.
    assert wrench_margin_n(FEET, UP, 3.0, WEIGHT, TOP) == pytest.approx(10.0, rel=1e-3)


def test_on_three_feet_a_load_over_the_edge_has_no_margin_and_one_inside_has() -> None:
    assert wrench_margin_n(FEET[:3], UP[:3], 0.5, WEIGHT, TOP) == pytest.approx(0.0, abs=1e-3)
    inside = np.array([0.0, 0.0, -10.0, -3.0, 3.0, 0.0])  # weight at (0.3, 0.3)
    # 0.3 sqrt(2) from the edge, 10 N, push at height 1.
    held = wrench_margin_n(FEET[:3], UP[:3], 0.8, inside, [0.3, 0.3, 1.0])
    assert held == pytest.approx(3.0 * math.sqrt(2), rel=1e-3)


def test_a_slope_too_steep_for_friction_is_held_with_a_rope_and_its_limit_counts() -> None:
    slope = math.radians(45.0)
    load = np.array([-10.0 * math.sin(slope), 0.0, -10.0 * math.cos(slope), 0.0, 0.0, 0.0])
    rope = np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
    low = np.array([0.0, 0.0, 0.0])
    assert wrench_margin_n(FEET, UP, 0.5, load, low) == 0.0
    pull = 10.0 * math.sin(slope)
    held = wrench_margin_n(FEET, UP, 0.5, load, low, rope, [(pull, pull)])
    assert held == pytest.approx(0.5 * 10.0 * math.cos(slope), rel=1e-3)
    weak = wrench_margin_n(FEET, UP, 0.5, load, low, rope, [(0.0, 0.7 * pull)])
    assert weak == pytest.approx(0.5 * 10.0 * math.cos(slope) - 0.3 * pull, rel=1e-3)


def test_a_block_is_tipped_by_the_work_that_lifts_its_weight_over_the_edge() -> None:
    force = np.array([[0.0, 0.0, -10.0]])
    assert tipping_work_j(FEET, force, [[0.0, 0.0, 1.0]]) == pytest.approx(
        10.0 * (math.sqrt(2.0) - 1.0)
    )
    assert tipping_work_j(FEET, force, [[0.5, 0.0, 1.0]]) == pytest.approx(
        10.0 * (math.hypot(0.5, 1.0) - 1.0)
    )
    assert tipping_work_j(FEET, force, [[1.2, 0.0, 1.0]]) == 0.0
    assert tipping_work_j(FEET[:2], force, [[0.0, 0.0, 1.0]]) == 0.0


def test_a_pull_down_on_the_stance_adds_to_the_work() -> None:
    """Weight 10 and a pull of 10 at the same point: twice the work."""
    forces, points = np.tile([0.0, 0.0, -10.0], (2, 1)), np.tile([0.0, 0.0, 1.0], (2, 1))
    assert tipping_work_j(FEET, forces, points) == pytest.approx(20.0 * (math.sqrt(2.0) - 1.0))


def test_a_foot_between_the_others_makes_no_edge_to_tip_about() -> None:
    corners = np.array([[2.0, 0.0, 0.0], [-1.0, 1.5, 0.0], [-1.0, -1.5, 0.0]])
    force, at = [[0.0, 0.0, -10.0]], [[0.5, 0.0, 1.0]]
    inner = np.vstack([corners, [[0.2, 0.3, 0.0]]])
    assert tipping_work_j(inner, force, at) == pytest.approx(tipping_work_j(corners, force, at))
