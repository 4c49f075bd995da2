"""The moving-horizon rival, on moments whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.benchmarks.machines.moving_horizon import NODES, Horizon, Node

SQUARE = np.array([[1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, -1.0]])
WEIGHT_N = 4000.0
HORIZON = Horizon(np.array([10.0, 10.0, 10.0, 10.0, 10.0, 10.0]))


def node(forces: np.ndarray, carries: tuple[bool, ...] = (True,) * 4) -> Node:
    """Feet at the corners of a square that carry a weight in its middle."""
    by_force = np.zeros((6, 12))
    for leg, point in enumerate(SQUARE):
        by_force[:3, 3 * leg : 3 * leg + 3] = np.eye(3)
        by_force[3:, 3 * leg : 3 * leg + 3] = np.cross(point, np.eye(3)).T
    weight = np.array([0.0, 0.0, -WEIGHT_N, 0.0, 0.0, 0.0])
    return Node(forces.ravel(), np.full(12, 300.0), np.array(carries), by_force, weight)


def last_loads(*nodes: Node) -> np.ndarray:
    forces, _ = HORIZON.estimate(list(nodes), None)
    return forces[-1].reshape(4, 3)


def test_the_weight_corrects_what_cylinders_say_alike() -> None:
    read = np.zeros((4, 3))
    read[:, 2] = 1200.0
    found = last_loads(*[node(read)] * NODES)
    np.testing.assert_allclose(found[:, 2], 1000.0, atol=2.0)
    np.testing.assert_allclose(found[:, :2], 0.0, atol=1.0)


def test_a_foot_with_a_gap_carries_nothing_and_the_others_all() -> None:
    read = np.zeros((4, 3))
    read[:, 2] = (200.0, 1800.0, 1800.0, 200.0)
    found = last_loads(*[node(read, (False, True, True, True))] * NODES)
    assert np.abs(found[0]).max() < 1e-6
    assert found[:, 2].sum() == pytest.approx(WEIGHT_N, abs=5.0)


def test_feet_push_within_their_cones() -> None:
    read = np.zeros((4, 3))
    read[:, 2] = (-500.0, 2000.0, 2000.0, -500.0)
    read[1, 0] = 6000.0
    found = last_loads(*[node(read)] * NODES)
    assert found[:, 2].min() > -1e-6
    assert (np.abs(found[:, :2]) <= found[:, 2:] + 1e-3).all()


def test_a_window_tells_no_more_than_one_node() -> None:
    read = np.full((4, 3), 0.0)
    read[:, 2] = 1000.0
    _, once = HORIZON.estimate([node(read)], None)
    _, many = HORIZON.estimate([node(read)] * NODES, None)
    assert (many > 0.9 * once).all()
