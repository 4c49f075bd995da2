"""The shipped machine for tests: its numbers, its bodies."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from testbed.machine.build import build_machine
from testbed.machine.names import GRAVITY_M_S2
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


def slope_gravity(slope_rad: float) -> np.ndarray:
    """Gravity in the frame of a body that stands parallel to a slope rising towards its x axis,
    m/s2, (3,).
    """
    return GRAVITY_M_S2 * np.array([-np.sin(slope_rad), 0.0, -np.cos(slope_rad)])


def believed_robot(scenario: Scenario) -> Robot:
    """The robot of a scenario as estimators and control believe it."""
    belief, height_m = machines_of(scenario).belief, scenario.ropes.attachment_height_m
    return Robot.of(belief, scenario.carried_kg, height_m)
