"""Roll, pitch, yaw and quaternions: one rotation, told three ways."""

from __future__ import annotations

import math

import numpy as np
import pytest

from testbed.machine.urdf_shapes import rotation_from_rpy
from testbed.robot.model import (
    quaternions_of,
    rotation_from_attitude,
    rotations_of,
    small_turn,
)
from testbed.world.view import quaternion, turning_z_to


@pytest.mark.parametrize(
    ("rpy", "ahead", "up"),
    [
        ((0.0, 0.0, math.pi / 2), (0, 1, 0), (0, 0, 1)),  # yaw turns to the left
        ((0.0, math.pi / 2, 0.0), (0, 0, -1), (1, 0, 0)),  # pitch lets the nose down
        ((math.pi / 2, 0.0, 0.0), (1, 0, 0), (0, -1, 0)),  # roll lets the right side down
    ],
)
def test_each_angle_turns_about_its_axis(
    rpy: tuple[float, ...], ahead: tuple[int, ...], up: tuple[int, ...]
) -> None:
    rotation = rotation_from_attitude(np.array(rpy))
    assert rotation[:, 0] == pytest.approx(ahead, abs=1e-15)
    assert rotation[:, 2] == pytest.approx(up, abs=1e-15)


def test_all_ways_of_telling_a_rotation_agree() -> None:
    rng = np.random.default_rng(2)
    rpy = rng.uniform(-1.5, 1.5, (20, 3))
    rotations = np.array([rotation_from_attitude(one) for one in rpy])
    np.testing.assert_allclose(
        rotations @ rotations.swapaxes(1, 2), np.tile(np.eye(3), (20, 1, 1)), atol=1e-14
    )
    np.testing.assert_allclose(rotations_of(quaternions_of(rotations)), rotations, atol=1e-14)
    for angles, rotation in zip(rpy, rotations, strict=True):
        np.testing.assert_allclose(rotation_from_rpy(list(angles)), rotation, atol=1e-15)
        np.testing.assert_allclose(rotations_of(quaternion(rotation)), rotation, atol=1e-14)


def test_a_small_turn_is_read_off_about_the_bodys_own_axes() -> None:
    turn = np.array([1e-4, -2e-4, 3e-4])
    assert small_turn(rotation_from_attitude(turn)) == pytest.approx(turn, abs=1e-7)


@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 1, 0), (0.6, 0, -0.8), (0, 0, -1)])
def test_a_frame_is_made_about_any_axis(axis: tuple[float, ...]) -> None:
    frame = turning_z_to(np.array(axis, dtype=float))
    assert frame[:, 2] == pytest.approx(axis)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-15)


def test_quaternions_that_are_none_make_no_fault() -> None:
    """A recording may have been edited: its page is drawn as far as it goes."""
    found = rotations_of(np.array([[0.0, 0.0, 0.0, 0.0], [np.nan, 0.0, 0.0, 1.0]]))
    assert found.shape == (2, 3, 3) and found[0].tolist() == np.eye(3).tolist()
