"""The shipped machine for tests: its numbers, its bodies."""

from __future__ import annotations

from functools import lru_cache

from testbed.machine.build import build_machine
from testbed.robot.model import RobotModel
from testbed.robot.robot import Robot
from testbed.scenario.machines import machines_of
from testbed.scenario.scenario import Scenario

MACHINE = build_machine()


@lru_cache(maxsize=1)
def shipped_model() -> RobotModel:
    """Masses and gravity of the shipped machine without payload, read once."""
    return RobotModel(MACHINE.urdf)


@lru_cache(maxsize=1)
def shipped_robot() -> Robot:
    """The shipped machine with its bodies."""
    return Robot.of(MACHINE)


def believed_robot(scenario: Scenario) -> Robot:
    """The robot of a scenario as estimators and control believe it."""
    belief, height_m = machines_of(scenario).belief, scenario.ropes.attachment_height_m
    return Robot.of(belief, scenario.carried_kg, height_m)
