"""From legs and normals to contact axes, maps and compliances."""

from __future__ import annotations

import numpy as np

from testbed.robot.contact.geometry import contact_axes, contact_compliances, contact_maps

NORMALS = np.array([[0.0, 0.0, 1.0], [0.3, -0.2, 0.9]]) / np.array([[1.0], [np.sqrt(0.94)]])
UNDERSIDES = np.array([[1.0, 0.5, -0.9], [-1.0, 0.4, -0.8]])


def test_contact_axes_are_a_right_handed_frame_with_the_normal_first() -> None:
    frames = contact_axes(NORMALS)
    for frame, normal in zip(frames, NORMALS, strict=True):
        np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(frame[:, 0], normal, atol=1e-12)
        assert np.linalg.det(frame) > 0.0
    np.testing.assert_allclose(frames[0], np.eye(3)[:, [2, 0, 1]], atol=1e-12)


def test_a_normal_along_the_body_has_no_tangent_near_it() -> None:
    assert np.isnan(contact_axes(np.array([[1.0, 0.0, 0.0]]))[0, :, 1:]).any()


def test_a_map_is_the_force_and_its_moment_about_the_point() -> None:
    frames, about, radii = contact_axes(NORMALS), np.array([0.1, -0.2, 0.3]), (0.1, 0.14)
    legs = np.tile([0.0, 0.0, 1.0], (2, 1))  # the foot's centre lies above its underside
    maps = contact_maps(UNDERSIDES, legs, frames, np.array(radii), about)
    for i in range(2):
        touch = UNDERSIDES[i] + radii[i] * (legs[i] - NORMALS[i]) - about
        for k in range(3):
            wrench = np.concatenate([frames[i][:, k], np.cross(touch, frames[i][:, k])])
            np.testing.assert_allclose(maps[i, :, k], wrench, atol=1e-12)


def test_compliances_are_those_of_joints_and_ground_in_contact_axes() -> None:
    rng = np.random.default_rng(4)
    frames, jacobians = contact_axes(NORMALS), rng.normal(size=(2, 3, 12))
    joints, ground = rng.uniform(1e-8, 1e-7, 12), np.tile(1e-8 * np.eye(3), (2, 1, 1))
    found = contact_compliances(jacobians, joints, ground, frames)
    for i in range(2):
        in_body = jacobians[i] @ np.diag(joints) @ jacobians[i].T + ground[i]
        np.testing.assert_allclose(found[i], frames[i].T @ in_body @ frames[i], rtol=1e-12)
