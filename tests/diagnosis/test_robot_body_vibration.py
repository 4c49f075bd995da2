"""Joints of standing legs accelerate as the body over them does, however quickly it shakes; those
of legs in the air as encoders show within a bin.
"""

from __future__ import annotations

import numpy as np
import pytest

from testbed.diagnosis.robot.bins import Frame
from testbed.diagnosis.robot.body_vibration import of_lifted_feet, over_standing_feet, quick
from testbed.machine.build import build_machine
from testbed.robot.robot import Robot


def test_a_foot_that_stands_does_not_accelerate_and_one_in_the_air_is_not_asked() -> None:
    model = Robot.of(build_machine()).model
    rng = np.random.default_rng(8)
    joint = model.limits.mean(axis=1) + 0.02 * rng.standard_normal((3, 12))
    carrying = np.array([[1.0, 1.0, 1.0, 0.0]] * 3)
    moves, turns = rng.normal(0.0, 0.3, (2, 3, 3))
    found = over_standing_feet(model, joint, carrying, moves, turns)
    for k in range(3):
        feet, jacobians = model.feet(joint[k])
        for leg in range(3):
            foot = moves[k] + np.cross(turns[k], feet[leg]) + jacobians[leg] @ found[k]
            assert foot == pytest.approx(np.zeros(3), abs=1e-9)
    assert np.all(found[:, 9:] == 0.0)


def test_encoders_and_inertial_unit_together_tell_any_acceleration() -> None:
    true = np.random.default_rng(9).normal(0.0, 1.0, (40, 3))
    rate = (
        np.cumsum(true, axis=0) - 0.5 * true
    )  # mean speed in each bin, of a constant acceleration
    encoders = 0.5 * (rate[2:] - rate[:-2])
    assert encoders + quick(true)[1:-1] == pytest.approx(true[1:-1])


def test_a_leg_that_rocks_five_times_a_second_accelerates_in_the_air() -> None:
    time = np.arange(0.0, 4.0, 1e-3)
    frame, swing = Frame.of(time), 2.0 * np.pi * 5.0
    place = np.sin(swing * time) / swing**2
    found, true = frame.change_of_speed(place), frame.mean(-np.sin(swing * time))
    assert np.ptp(true) > 1.2
    assert found == pytest.approx(0.9 * true, abs=0.04 * np.ptp(true))
    in_bins = np.diff(frame.at_edges(place)) / 0.1
    assert np.ptp(0.5 * (in_bins[2:] - in_bins[:-2]) / 0.1) < 0.05 * np.ptp(true)


def test_only_legs_in_the_air_are_asked_within_a_bin() -> None:
    within, change = np.full((1, 12), 2.0), np.full((1, 12), 1.0)
    found = of_lifted_feet(within, change, np.array([[1.0, 0.0, 0.6, 0.4]]))
    assert found[0].tolist() == np.repeat([1.0, 2.0, 1.0, 2.0], 3).tolist()
