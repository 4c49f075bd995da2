"""The model file of one leg: the published model with its numbers, friction (5), and named effects.

    F_ext = pA A_A - pB A_B - F_f(v) + m g cos(inclination) - m a
    F_f(v) = sigma v + sign(v) [F_c0 + F_s0 exp(-|v| / c_s)], separate for v > 0 and v < 0   (5)

The YAML file: `format`, `rig`, `known` (numbers), `friction` (eight parameters), `effects` (a list
of `{name, parameters}`, a parameter being a number or `{value, unit, interval90}`; on a whole robot
also `place`, an axis such as `fl_vertical`).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, field_validator, model_validator

from testbed.errors import InputError
from testbed.formats.checked import Checked, Pair, Sequence, checked
from testbed.formats.yaml_files import read_mapping, write_yaml
from testbed.machine.names import AXES, LEGS
from testbed.recording.known import Known, NotNegative, Positive

FORMAT = "roboclimber-model/1"
MODEL = f"a model file (format: {FORMAT}) of testbed identify, commission or diagnose"


class Friction(Checked):
    """Equation (5): eight parameters, SI; `plus` for extension (v > 0)."""

    viscous_plus_n_s_m: float = 0.0
    coulomb_plus_n: NotNegative = 0.0
    stribeck_plus_n: NotNegative = 0.0
    stribeck_speed_plus_m_s: Positive = 0.01
    viscous_minus_n_s_m: float = 0.0
    coulomb_minus_n: NotNegative = 0.0
    stribeck_minus_n: NotNegative = 0.0
    stribeck_speed_minus_m_s: Positive = 0.01

    @property
    def breakaway_n(self) -> tuple[float, float]:
        """(plus, minus) break-away force F_c0 + F_s0, both >= 0: at rest friction lies in [-minus,
        plus].
        """
        return (
            self.coulomb_plus_n + self.stribeck_plus_n,
            self.coulomb_minus_n + self.stribeck_minus_n,
        )


class Parameter(Checked):
    """An effect's parameter: value, unit, and the interval that holds the truth in 90 of 100
    cases.
    """

    value: float
    unit: str | None = None
    interval90: Pair | None = None


def _plain_numbers(value: Any) -> Any:
    if not isinstance(value, Mapping):
        return value
    return {
        key: number if isinstance(number, (Mapping, Parameter)) else {"value": number}
        for key, number in value.items()
    }


Parameters = Annotated[dict[str, Parameter], BeforeValidator(_plain_numbers)]
"""Parameters by name; a file may give a number alone."""


class EffectEntry(Checked):
    """A named effect with its parameters, as files carry it."""

    name: Annotated[str, Field(min_length=1)]
    parameters: Parameters
    place: str | None = None

    @field_validator("place")
    @classmethod
    def _an_axis(cls, value: str | None) -> str | None:
        if value is not None and value not in AXES and value not in LEGS:
            raise ValueError(
                f"is not a leg or an axis (allowed: {', '.join(LEGS)}, or fl_vertical and the like)"
            )
        return value

    @property
    def values(self) -> dict[str, float]:
        """Parameter name -> value."""
        return {key: parameter.value for key, parameter in self.parameters.items()}


class LegModel(Checked):
    """The believed model of one leg; `force_offset_n` is a constant force of sensor zeros,
    downwards; `force_held_s` the time by which a drive's force acts later than its row says: one
    that is a command, held until the next, half a sample in the mean.
    """

    format: Literal["roboclimber-model/1"] = "roboclimber-model/1"
    rig: Literal["vertical-leg", "cylinder", "drive"] = "vertical-leg"
    known: Known
    friction: Friction = Friction()
    force_offset_n: float = 0.0
    force_held_s: NotNegative = 0.0
    effects: Annotated[tuple[EffectEntry, ...], Sequence] = ()
    description: str | None = None

    @model_validator(mode="after")
    def _only_a_drive_is_commanded(self) -> Self:
        if self.force_held_s and self.rig != "drive":
            raise ValueError(f"force_held_s would have no effect on a {self.rig} (allowed: 0)")
        return self


def read_model(path: str | Path) -> LegModel:
    """Read a model file. Raises InputError naming file, field, value and what is allowed.

    The names of effects are checked by `testbed.effects.build`, which knows them.
    """
    return checked(LegModel, model_tree(path), Path(path))


def model_tree(path: str | Path) -> dict[str, Any]:
    """What a model file of any rig holds, unchecked but for its format. Raises InputError."""
    tree = read_mapping(Path(path), MODEL)
    if tree.get("format") != FORMAT:
        raise InputError(
            "is not a model's format",
            file=Path(path),
            field="format",
            value=tree.get("format"),
            allowed=FORMAT,
        )
    return tree


def write_model(path: str | Path, model: LegModel) -> None:
    """Write a model file. Raises InputError where it cannot be written."""
    tree = model.model_dump(mode="json", exclude_none=True)
    tree.pop("description", None)
    write_yaml(Path(path), tree | ({"description": model.description} if model.description else {}))
