"""The model file of the whole robot: what it believes of itself beyond its drawing.

The YAML file: `format`, `rig: robot`, `machine` (path of `testbed parameters` -> value), `effects`
(a list of `{name, place, parameters}`). A number is `{value, unit, interval90}` or bare.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from testbed.formats.checked import Checked, Sequence, checked
from testbed.formats.yaml_files import read_mapping, write_yaml
from testbed.recording.leg_model import MODEL, Parameters, model_tree
from testbed.scenario.parts import Undeclared


class PlacedEffect(Checked):
    """An effect of the robot, and where it sits."""

    name: Annotated[str, Field(min_length=1)]
    place: str
    parameters: Parameters

    def hidden(self) -> Undeclared:
        """The same as a scenario's entry, which checks the place. Raises InputError."""
        values = {name: parameter.value for name, parameter in self.parameters.items()}
        told = {"effect": self.name, "at": self.place, "parameters": values}
        return checked(Undeclared, told, f"effects.{self.name}")


class RobotModelFile(Checked):
    """What a robot believes of itself beyond its drawing."""

    format: Literal["roboclimber-model/1"] = "roboclimber-model/1"
    rig: Literal["robot"] = "robot"
    description: str = ""
    machine: Parameters = Field(default_factory=dict)
    effects: Annotated[tuple[PlacedEffect, ...], Sequence] = ()

    @property
    def numbers(self) -> dict[str, float]:
        """Path of the machine -> believed value."""
        return {path: parameter.value for path, parameter in self.machine.items()}


def is_robot_model(path: str | Path) -> bool:
    """Whether a model file is one of the whole robot."""
    return read_mapping(Path(path), MODEL).get("rig") == "robot"


def read_robot_model(path: str | Path) -> RobotModelFile:
    """Read the model file of a robot. Raises InputError naming file, field, value and what is
    allowed.
    """
    return checked(RobotModelFile, model_tree(path), Path(path))


def write_robot_model(path: str | Path, model: RobotModelFile) -> None:
    """Write the model file of a robot. Raises InputError where it cannot be written."""
    write_yaml(Path(path), model.model_dump(mode="json", exclude_none=True))
