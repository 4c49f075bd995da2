"""What the drill's own controls know, as a wrench on the machine."""

from __future__ import annotations

import numpy as np
import pytest

from testbed import resources
from testbed.recording.rows import DrillKnown
from testbed.robot.loads.foot_loads import drill_wrench, known_wrench, rods_wrench
from testbed.robot.model import RobotModel

MODEL = RobotModel(resources.urdf())
LEVEL = np.array([0.0, 0.0, -9.81])
STEEP = np.array([-9.81, 0.0, 0.0])


def test_without_rods_only_what_was_ordered_acts() -> None:
    np.testing.assert_allclose(
        known_wrench(MODEL, DrillKnown.of(ordered_thrust=5e3, ordered_torque=-300.0), LEVEL),
        drill_wrench(MODEL, 5e3, -300.0),
    )


def test_a_rod_from_the_store_to_the_mast_moves_its_weight_and_adds_none() -> None:
    """90 kg over the way from the store to the drill axis: 882.9 N times that way."""
    moved = rods_wrench(
        MODEL, DrillKnown.of(rods_in_mast=90.0, rods_stored=-90.0, rods_mast_height=0.75), LEVEL
    )
    way = MODEL.drill_mount_m - MODEL.rod_store_m
    np.testing.assert_allclose(moved[:3], 0.0, atol=1e-9)
    np.testing.assert_allclose(moved[3:], [-882.9 * way[1], 882.9 * way[0], 0.0], atol=1e-9)
    assert np.linalg.norm(moved[3:]) == pytest.approx(
        372.6, abs=0.1
    )  # 0.422 m: 190 N on a foot of 1.9 m track


def test_on_a_wall_the_hole_carries_the_string_and_the_store_is_relieved() -> None:
    """At 90 degrees nothing of the string hangs on the feed: the machine is 60 kg, 588.6 N, lighter
    along the slope.
    """
    moved = rods_wrench(MODEL, DrillKnown.of(rods_in_hole=60.0, rods_stored=-60.0), STEEP)
    np.testing.assert_allclose(moved[:3], [588.6, 0.0, 0.0], atol=1e-9)


def test_the_height_in_the_mast_tells_on_a_slope() -> None:
    low, high = (
        rods_wrench(MODEL, DrillKnown.of(rods_in_mast=10.0, rods_mast_height=m), STEEP)
        for m in (0.0, 2.0)
    )
    assert (high - low)[4] == pytest.approx(-10.0 * 9.81 * 2.0)
