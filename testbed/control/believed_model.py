"""The machine's masses and geometry as control believes them."""

from __future__ import annotations

from pathlib import Path

from testbed import resources
from testbed.machine.provenance import roboclimber
from testbed.robot.model import Payload, RobotModel
from testbed.scenario.scenario import Scenario


def believed_model(scenario: Scenario) -> RobotModel:
    """The scenario's URDF with its declared payload and rods at the believed place of the rod store."""
    parameters = roboclimber().replaced(scenario.model.parameters)
    mass = scenario.carried_kg
    payload = Payload(mass, parameters["rod_store_body"]["position_m"]) if mass > 0 else None
    urdf = Path(scenario.robot.urdf) if scenario.robot.urdf else resources.urdf()
    return RobotModel(urdf, payload, scenario.ropes.attachment_height_m)
