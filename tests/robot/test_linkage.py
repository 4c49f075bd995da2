"""Linkages: known triangles, derivatives against finite differences, and back."""

from __future__ import annotations

import math

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.machine.names import ROTATION
from testbed.robot.linkage import (
    INCLINED,
    LEVER,
    Linkage,
    Linkages,
    arm_of,
    joint_of,
    length_of,
    straight,
)

DRAWN = Linkages.from_machine(build_machine())
MIXED = Linkages.from_machine(
    build_machine(
        {
            "vertical_linkage.across_m": 0.4,
            "vertical_linkage.along_m": 0.5,
            "radial_linkage.ratio": 0.5,
            "axes.rl_rotation.linkage.rack_radius_m": 0.15,
            "axes.fr_rotation.linkage.lever_m": 0.25,
            "axes.fr_rotation.limits.upper_rad": 0.4,
        }
    )
)
SHARES = np.linspace(0.0, 1.0, 41)[:, None]
"""Places between both limits of every joint."""


def _joints(linkages: Linkages) -> np.ndarray:
    lower, upper = linkages.limits.T
    return lower + SHARES * (upper - lower)


def _lever(anchor_m: float, lever_m: float) -> Linkage:
    return Linkage.of(kind=LEVER, anchor=anchor_m, lever=lever_m, neutral=math.pi / 2)


def test_a_right_triangle_of_3_4_5_gives_length_5_and_arm_12_fifths() -> None:
    assert length_of(0.0, _lever(4.0, 3.0)) == pytest.approx(5.0, rel=1e-14)
    assert arm_of(0.0, _lever(4.0, 3.0)) == pytest.approx(12.0 / 5.0, rel=1e-14)


def test_a_cylinder_that_stands_3_by_4_beside_its_slide_is_5_long_with_arm_3_fifths() -> None:
    askew = Linkage.of(kind=INCLINED, slope=1.0, along=2.0, across=4.0)
    assert length_of(1.0, askew) == pytest.approx(5.0, rel=1e-14)
    assert arm_of(1.0, askew) == pytest.approx(3.0 / 5.0, rel=1e-14)


def test_a_rack_turns_by_arc_over_radius_and_a_chain_halves_the_stroke() -> None:
    lower, upper = MIXED.limits.T
    assert MIXED.stroke_m[6] == pytest.approx(0.15 * (upper[6] - lower[6]), rel=1e-14)
    assert MIXED.stroke_m[1] == pytest.approx(0.5 * upper[1], rel=1e-14)


@pytest.mark.parametrize("linkages", [DRAWN, MIXED], ids=["drawn", "mixed"])
def test_arms_are_the_derivatives_of_extensions(linkages: Linkages) -> None:
    joints, step = _joints(linkages), 1e-6
    slope = (linkages.rods(joints + step)[0] - linkages.rods(joints - step)[0]) / (2 * step)
    np.testing.assert_allclose(linkages.rods(joints)[1], slope, rtol=1e-7)


@pytest.mark.parametrize("linkages", [DRAWN, MIXED], ids=["drawn", "mixed"])
def test_extensions_grow_from_zero_to_the_stroke(linkages: Linkages) -> None:
    extensions = linkages.rods(_joints(linkages))[0]
    np.testing.assert_allclose(extensions[0], 0.0, atol=1e-15)
    np.testing.assert_allclose(extensions[-1], linkages.stroke_m, rtol=1e-12)
    assert np.all(np.diff(extensions, axis=0) > 0.0)


def test_the_drawn_levers_stroke_by_hand() -> None:
    """sqrt(0.55^2 + 0.2^2 - 2 0.55 0.2 cos 125 deg) - the same with cos 55 deg."""
    by_hand = math.sqrt(0.3425 + 0.1261868) - math.sqrt(0.3425 - 0.1261868)
    np.testing.assert_allclose(DRAWN.stroke_m[list(ROTATION)], by_hand, atol=1e-6)


@pytest.mark.parametrize("linkages", [DRAWN, MIXED], ids=["drawn", "mixed"])
def test_the_joints_of_the_extensions_of_joints_are_those_joints(linkages: Linkages) -> None:
    for joints in _joints(linkages):
        np.testing.assert_allclose(
            linkages.joints(linkages.rods(joints)[0]), joints, rtol=1e-12, atol=1e-12
        )
    assert math.isnan(joint_of(9.0, DRAWN.records[0]))
    assert math.isnan(joint_of(-9.0 + 8.7, MIXED.records[2]))


def test_straight_cylinders_are_their_joints_to_the_last_bit() -> None:
    joints = np.array([0.1, 0.2, 0.3, -0.4, 0.1, 0.5, 0.6, 0.0, 0.1, -0.2, 0.4, 0.25])
    extensions, arms = DRAWN.rods(joints)
    slides = [i for i in range(12) if i not in ROTATION]
    np.testing.assert_array_equal(extensions[slides], joints[slides])
    np.testing.assert_array_equal(arms[slides], 1.0)
    assert length_of(0.3, straight(1)[0]) == 0.3


def test_gains_are_those_of_the_first_legs_posture() -> None:
    joints = np.tile([0.1, 0.2, 0.3], 4) * np.repeat([1.0, -1.0, 2.0, 0.5], 3)
    arms = MIXED.gain_arms(joints)
    assert arms[2] == arms[5] == MIXED.rods(joints)[1][2]
    assert arms[6] == 0.15, "a rack's arm is its radius everywhere"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"rotation_linkage.angle_neutral_rad": 0.3}, r"rotation_linkage.*dead centre"),
        ({"axes.rr_rotation.linkage.angle_neutral_rad": 2.9}, r"axes\.rr_rotation.*dead centre"),
        (
            {"vertical_linkage.across_m": 1.0, "vertical_linkage.along_m": 0.05},
            r"vertical_linkage\.along_m.*at least 0\.1",
        ),
    ],
)
def test_a_dead_centre_within_the_range_is_refused(changes: dict[str, float], said: str) -> None:
    with pytest.raises(InputError, match=said):
        Linkages.from_machine(build_machine(changes))
