"""The model file of the whole robot: what it believes of itself beyond its drawing.

The YAML file: `format`, `rig: robot`, `machine` (path of `testbed parameters` -> value), `effects`
(a list of `{name, place, parameters}`). A number is `{value, unit, interval90}` or bare.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from testbed.errors import InputError
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
        fields = {"effect": self.name, "at": self.place, "parameters": values}
        return checked(Undeclared, fields, f"effects.{self.name}")


SAME_DRAWING = 1e-4
"""Drawings whose masses differ by a larger share are two (E)."""


class RobotModelFile(Checked):
    """What a robot believes of itself beyond its drawing."""

    format: Literal["roboclimber-model/1"] = "roboclimber-model/1"
    rig: Literal["robot"] = "robot"
    description: str = ""
    drawing_mass_kg: Annotated[float, Field(gt=0.0)] | None = None
    """mass of the machine's drawing, beside which all this is believed [kg]; null: not said"""
    machine: Parameters = Field(default_factory=dict)
    effects: Annotated[tuple[PlacedEffect, ...], Sequence] = ()

    @property
    def numbers(self) -> dict[str, float]:
        """Path of the machine -> believed value."""
        return {path: parameter.value for path, parameter in self.machine.items()}


def check_drawing(model: RobotModelFile, total_mass_kg: float, file: str | Path) -> None:
    """Refuse to believe of a machine of this drawing what was found beside another one's.

    Raises InputError.
    """
    of_kg = model.drawing_mass_kg
    if of_kg is not None and abs(of_kg - total_mass_kg) > SAME_DRAWING * total_mass_kg:
        raise InputError(
            "is of another machine",
            file=file,
            field="drawing_mass_kg",
            value=of_kg,
            allowed=f"{total_mass_kg:.6g} kg, as this machine's drawing has it",
        )


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
