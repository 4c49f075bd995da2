"""Closed-form kinematics of the legs: there and back, against Pinocchio, and lengths to the last
bit.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from shipped import MACHINE

from testbed.robot.model import RobotModel
from testbed.robot.robot import LegKinematics, exact_square, length

LEGS_OF_MACHINE = LegKinematics.from_machine(MACHINE)


def postures(count: int = 50) -> np.ndarray:
    """Joints (count, 12) all over their ranges."""
    low, high = RobotModel(MACHINE.urdf).limits.T
    return np.random.default_rng(6).uniform(low, high, (count, 12))


def test_feet_stand_where_pinocchio_has_them() -> None:
    model = RobotModel(MACHINE.urdf)
    for joints in postures():
        assert LEGS_OF_MACHINE.feet(joints) == pytest.approx(
            model.foot_positions_m(joints), abs=1e-9
        )


def test_joints_of_feet_are_the_joints_that_put_them_there() -> None:
    for joints in postures():
        back = LEGS_OF_MACHINE.joints(LEGS_OF_MACHINE.feet(joints))
        assert back == pytest.approx(joints, abs=1e-12)


@pytest.mark.parametrize("leg", range(4))
def test_one_foot_is_where_it_is_among_all_four(leg: int) -> None:
    joints = postures(1)[0]
    one = LEGS_OF_MACHINE.leg_foot(leg, joints[3 * leg : 3 * leg + 3].tolist())
    assert one == pytest.approx(LEGS_OF_MACHINE.feet(joints)[leg])


def test_further_out_by_a_joint_is_further_from_the_hip_by_as_much() -> None:
    joints = postures(1)[0]
    out = joints.copy()
    out[1::3] += 0.05
    ways = LEGS_OF_MACHINE.feet(out) - LEGS_OF_MACHINE.feet(joints)
    assert np.hypot(ways[:, 0], ways[:, 1]) == pytest.approx(0.05)
    assert ways[:, 2] == pytest.approx(0.0)


def test_compiled_lengths_are_those_of_python_to_the_last_bit() -> None:
    points = np.random.default_rng(2).normal(0.0, 3.0, (20_000, 2))
    found = [length(x, y) for x, y in points[:2000]]
    assert found == [math.hypot(x, y) for x, y in points[:2000]]
    assert length(0.0, 0.0) == 0.0


def test_a_square_in_two_parts_is_exact() -> None:
    for value in (1.0 + 2.0**-40, math.pi, 1e-3 + 1e-12):
        high, rest = exact_square(value)
        numerator, denominator = value.as_integer_ratio()
        parts = [part.as_integer_ratio() for part in (high, rest)]
        total = sum(n * denominator**2 / d for n, d in parts if d)
        assert high == value * value and total == pytest.approx(numerator**2, rel=1e-15)
        assert abs(rest) <= math.ulp(high)
