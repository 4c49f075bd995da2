"""What the best estimate of a standing machine can do, where the answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.benchmarks.machines.best_stand import (
    by_cylinders,
    hidden_by_seals,
    of_the_body,
    worse_than_published,
)
from testbed.benchmarks.machines.runs import DrawnMachine
from testbed.estimation.live.uncertainty import Uncertainty, constants
from testbed.machine.names import GRAVITY_M_S2, VERTICAL
from testbed.robot.robot import Robot
from testbed.scenario.machines import machines_of
from testbed.scenario.scenario import Scenario
from testbed.world.start import nominal_joints


@pytest.fixture(scope="module")
def stand() -> Scenario:
    return DrawnMachine(2000, "workshop").task("stand")


@pytest.fixture(scope="module")
def robot(stand: Scenario) -> Robot:
    return Robot.of(machines_of(stand).belief, stand.carried_kg, stand.ropes.attachment_height_m)


def test_a_vertical_cylinder_lifts_the_body_over_its_foot(stand: Scenario, robot: Robot) -> None:
    joints = nominal_joints(stand)
    feet, _ = robot.model.feet(joints)
    for foot, column in zip(feet, by_cylinders(robot, joints).T[list(VERTICAL)], strict=True):
        assert column[:3] == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)
        assert column[3:] == pytest.approx([foot[1], -foot[0], 0.0], abs=1e-9)


def test_a_body_that_is_known_exactly_leaves_nothing(stand: Scenario, robot: Robot) -> None:
    known = constants(Uncertainty(None), robot.machine)[0]
    assert np.all(of_the_body(robot, known, -0.8, stand) == 0.0)


def test_an_uncertain_weight_is_missed_along_gravity(stand: Scenario, robot: Robot) -> None:
    known = constants(Uncertainty("workshop"), robot.machine)[0]
    missed = of_the_body(robot, known, -np.pi / 4.0, stand)[:, 0]
    newton = known["mass"] * GRAVITY_M_S2 / np.sqrt(2.0)
    assert missed[:3] == pytest.approx([-newton, 0.0, -newton], rel=1e-6)
    assert np.all(missed[3:] == 0.0)


def test_seals_hide_up_to_break_away(robot: Robot) -> None:
    cylinder = robot.machine.axes["fl_vertical"].cylinder
    most = cylinder.coulomb_out_n + cylinder.static_out_n
    least = cylinder.coulomb_in_n + cylinder.static_in_n
    assert hidden_by_seals(robot.machine)[2] == pytest.approx(0.5 * (most + least))


def test_knowledge_of_the_body_makes_bad_luck_rarer(
    stand: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    by_chance = worse_than_published(stand)
    known = "testbed.benchmarks.machines.best_stand.of_the_body"
    monkeypatch.setattr(known, lambda *_: np.zeros((6, 1)))
    assert worse_than_published(stand) < 0.1 * by_chance
    assert 0.01 < by_chance < 0.1
