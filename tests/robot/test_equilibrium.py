"""Holding a posture: forces balance, friction is used least, and an impossible share is refused with what would do."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shipped import shipped_model

from testbed.errors import InputError
from testbed.robot.equilibrium import (
    StaticEquilibrium,
    balanced_attachment_height_m,
    static_equilibrium,
)
from testbed.robot.loads.foot_loads import external_wrench, point_wrench
from testbed.robot.model import Payload, slope_gravity

MODEL = shipped_model()
STANCE = np.tile([0.0, 0.2, 0.25], 4)
WEIGHT = 4000.0 * 9.81
ALONG = np.tile([1.0, 0.0, 0.0], (2, 1))
SPREAD = np.array([[30.0, 5.0, 0.5], [30.0, -5.0, 0.5]]) / math.hypot(30.0, 5.0, 0.5)


def left_over(found: StaticEquilibrium, slope: float, directions: np.ndarray) -> np.ndarray:
    """All wrenches added up, without the solver."""
    ropes = found.rope_tension_n[:, None] * directions
    total = external_wrench(MODEL, STANCE, slope_gravity(slope), None, ropes, None)
    for force, point in zip(
        found.foot_forces_in_body_n, MODEL.foot_positions_m(STANCE), strict=True
    ):
        total = total + point_wrench(force, point)
    return total


@pytest.mark.parametrize("degrees", [0.0, 30.0, 45.0, 60.0, 80.0, 85.0])
def test_forces_and_moments_balance_on_every_slope(degrees: float) -> None:
    slope = math.radians(degrees)
    found = static_equilibrium(
        MODEL, STANCE, slope_gravity(slope), 0.65, rope_directions_in_body=SPREAD
    )
    assert np.abs(left_over(found, slope, SPREAD)).max() < 1e-6 * WEIGHT
    assert np.all(found.foot_forces_in_body_n[:, 2] > 0.0) and np.all(found.rope_tension_n >= 0.0)
    assert found.friction_use.max() < 1.0


def test_without_ropes_every_foot_uses_friction_alike_and_as_little_as_the_slope_asks() -> None:
    found = static_equilibrium(MODEL, STANCE, slope_gravity(math.radians(20.0)), 0.65)
    np.testing.assert_allclose(found.friction_use, math.tan(math.radians(20.0)) / 0.65, rtol=1e-3)


def test_ropes_along_the_slope_that_carry_a_share_have_that_tension() -> None:
    slope = math.radians(60.0)
    found = static_equilibrium(
        MODEL, STANCE, slope_gravity(slope), 0.65, rope_directions_in_body=ALONG, rope_share=0.9
    )
    assert found.rope_tension_n.sum() == pytest.approx(0.9 * WEIGHT * math.sin(slope), rel=1e-9)
    assert found.rope_share == pytest.approx(0.9)
    assert found.foot_forces_in_body_n[:, 0].sum() == pytest.approx(
        0.1 * WEIGHT * math.sin(slope), rel=1e-9
    )


def test_joint_forces_hold_the_feet_and_the_legs_own_weight() -> None:
    slope = math.radians(40.0)
    gravity = slope_gravity(slope)
    found = static_equilibrium(
        MODEL, STANCE, gravity, 0.65, rope_directions_in_body=SPREAD, rope_share=0.9
    )
    vertical = found.joint_forces[2::3]
    # Each vertical joint pushes its foot down with the foot's load less the frame's own weight along the axis.
    np.testing.assert_allclose(
        vertical, found.foot_forces_in_body_n[:, 2] - 91.7 * 9.81 * math.cos(slope), rtol=1e-9
    )
    for leg, direction in enumerate((60.0, -60.0, 120.0, -120.0)):
        outward = np.array(
            [math.cos(math.radians(direction)), math.sin(math.radians(direction)), 0.0]
        )
        moved = 186.7 * gravity @ outward
        expected = -(found.foot_forces_in_body_n[leg] @ outward) - moved
        assert found.joint_forces[3 * leg + 1] == pytest.approx(expected, rel=1e-9)


def test_a_share_too_small_is_refused_with_the_share_that_would_do() -> None:
    slope = math.radians(60.0)
    # By hand: 1 - 0.65 cos 60 / sin 60 = 0.625; the pyramid inside the cone asks for a little more.
    with pytest.raises(InputError, match=r"ropes\.share = 0\.5.*at least about 0\.6[23]"):
        static_equilibrium(
            MODEL, STANCE, slope_gravity(slope), 0.65, rope_directions_in_body=ALONG, rope_share=0.5
        )


def test_a_slope_too_steep_without_ropes_is_refused() -> None:
    with pytest.raises(InputError, match="cannot hold this posture"):
        static_equilibrium(MODEL, STANCE, slope_gravity(math.radians(40.0)), 0.65)


def test_the_shipped_attachment_height_balances_a_share_of_095() -> None:
    assert balanced_attachment_height_m(MODEL, STANCE, 0.95) == pytest.approx(
        MODEL.rope_attachments_m[0, 2], abs=0.002
    )
    assert balanced_attachment_height_m(MODEL, STANCE, 1.0) == pytest.approx(
        MODEL.centre_of_mass_m(STANCE)[2]
    )


def test_at_the_balanced_height_a_wall_of_85_degrees_loads_the_feet_as_level_ground_does() -> None:
    slope = math.radians(85.0)
    found = static_equilibrium(
        MODEL, STANCE, slope_gravity(slope), 0.8, rope_directions_in_body=ALONG, rope_share=0.95
    )
    normal = found.foot_forces_in_body_n[:, 2]
    pressure = (normal @ MODEL.foot_positions_m(STANCE)[:, 0]) / normal.sum()
    assert pressure == pytest.approx(MODEL.centre_of_mass_m(STANCE)[0], abs=0.005)


def test_a_ton_of_rods_high_on_the_mast_asks_for_a_higher_attachment() -> None:
    rods = Payload(1000.0, (0.3, 0.34, 0.95))
    raised = balanced_attachment_height_m(MODEL, STANCE, 1.0, rods)
    assert raised == pytest.approx((4 * MODEL.centre_of_mass_m(STANCE)[2] + 0.95) / 5)
    with pytest.raises(InputError, match="rope_share"):
        balanced_attachment_height_m(MODEL, STANCE, 0.0)
