"""The lever of joint 1: known triangles, derivative against finite differences, and back."""

from __future__ import annotations

import math

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.robot.linkage import RotationLinkage, joint_to_cylinder

LINKAGE = RotationLinkage.from_machine(build_machine())


def test_a_right_triangle_of_3_4_5_gives_length_5_and_arm_12_fifths() -> None:
    linkage = RotationLinkage(4.0, 3.0, math.pi / 2, -0.5, 0.5)
    assert linkage.extension_m(0.0) + linkage.closed_length_m == pytest.approx(5.0, rel=1e-14)
    assert linkage.moment_arm_m(0.0) == pytest.approx(12.0 / 5.0, rel=1e-14)


def test_moment_arm_is_the_derivative_of_the_cylinders_length() -> None:
    angles, step = np.linspace(-0.6, 0.6, 41), 1e-6
    slope = (LINKAGE.extension_m(angles + step) - LINKAGE.extension_m(angles - step)) / (2 * step)
    np.testing.assert_allclose(LINKAGE.moment_arm_m(angles), slope, rtol=1e-8)


def test_extension_runs_from_zero_to_the_stroke_and_grows_with_the_angle() -> None:
    angles = np.linspace(LINKAGE.lower_rad, LINKAGE.upper_rad, 50)
    extensions = LINKAGE.extension_m(angles)
    assert extensions[0] == pytest.approx(0.0, abs=1e-15)
    assert extensions[-1] == pytest.approx(LINKAGE.stroke_m)
    assert np.all(np.diff(extensions) > 0)
    # By hand: sqrt(0.55^2 + 0.2^2 - 2 0.55 0.2 cos 125 deg) - the same with cos 55 deg.
    assert LINKAGE.stroke_m == pytest.approx(
        math.sqrt(0.3425 + 0.1261868) - math.sqrt(0.3425 - 0.1261868), abs=1e-6
    )


def test_angle_of_the_extension_of_an_angle_is_that_angle() -> None:
    angles = np.linspace(-0.61, 0.61, 101)
    np.testing.assert_allclose(LINKAGE.angle_rad(LINKAGE.extension_m(angles)), angles, atol=1e-13)
    assert np.isnan(LINKAGE.angle_rad(1.0))


def test_power_at_the_piston_equals_power_at_the_joint() -> None:
    angle, rate, force, step = 0.3, 0.2, 9000.0, 1e-7
    piston_speed = (LINKAGE.extension_m(angle + rate * step) - LINKAGE.extension_m(angle)) / step
    assert force * piston_speed == pytest.approx(
        force * LINKAGE.moment_arm_m(angle) * rate, rel=1e-6
    )


def test_compiled_kernel_equals_the_arrays_on_joint_1_and_is_identity_on_joints_2_and_3() -> None:
    positions = np.array([0.1, 0.2, 0.3, -0.4, 0.1, 0.5, 0.6, 0.0, 0.1, -0.2, 0.4, 0.25])
    extensions, arms = np.empty(12), np.empty(12)
    joint_to_cylinder(positions, LINKAGE.geometry, extensions, arms)
    np.testing.assert_allclose(extensions[::3], LINKAGE.extension_m(positions[::3]), atol=1e-15)
    np.testing.assert_allclose(arms[::3], LINKAGE.moment_arm_m(positions[::3]), rtol=1e-15)
    for joint in (1, 2):
        np.testing.assert_array_equal(extensions[joint::3], positions[joint::3])
        np.testing.assert_array_equal(arms[joint::3], 1.0)


def test_a_dead_centre_within_the_range_is_refused() -> None:
    broken = build_machine({"rotation_linkage.angle_neutral_rad": 0.3})
    with pytest.raises(InputError, match="dead centre"):
        RotationLinkage.from_machine(broken)
