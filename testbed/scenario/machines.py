"""The two machines of a scenario: the one of the world, and the one that estimators and control
believe in.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field

import testbed.machine
from testbed.errors import InputError
from testbed.formats.checked import Checked, Pair, Sequence, checked
from testbed.formats.yaml_files import read_mapping
from testbed.machine.build import build_machine
from testbed.machine.model import Machine
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.machine.scale import Scale, exponent
from testbed.scenario.parts import Undeclared

if TYPE_CHECKING:
    from testbed.scenario.scenario import Scenario


# Drawn machines: what a workshop and a site make of the drawing, number by number, from one seed.
#
# A draw changes the world's machine and adds undeclared effects; the model keeps the drawing-board
# machine. Each number has a random stream of its own: another tolerance in the file leaves all
# other numbers as they are.

WORKSHOP = "workshop"
"""The tolerance file of a machine of which nothing else is said."""
OF_SIZE = ("m", "kg", "N", "Pa")
"""Units in which a machine of another size errs by more or less; a gyroscope's bias is its maker's.
"""
GROUND = "terrain.stiffness_n_m"
"""The one number of a draw that is neither the machine's nor an effect's: the ground's."""


class Tolerance(Checked):
    """By how much one number of a machine that was built differs from its drawing."""

    number: str = Field(min_length=1)
    """path, or effect@place.parameter; * for each"""
    by: Literal["factor", "offset", "value"]
    """what the draw does"""
    range: Pair
    """the draw lies between these"""
    unit: str
    """of the draw"""
    spread: Literal["uniform", "triangular"]
    """how draws lie in the range"""
    chance: float = Field(default=1.0, gt=0.0, le=1.0)
    """share of machines that have it"""
    about: float | None = None
    """what the drawing has, where the middle of the range is another; a machine that declares
    something else is believed as it is declared
    """
    mark: Literal["A", "B", "C", "D", "E"]
    """as in roboclimber.yaml"""
    source: str = Field(min_length=1)
    """where the range comes from"""

    def names(self) -> tuple[str, ...]:
        """The numbers that it stands for, every one drawn by itself."""
        if "*" not in self.number:
            return (self.number,)
        if self.number.startswith("rope."):
            each: tuple[str, ...] = tuple(f"rope_{side}" for side in SIDES)
        elif self.number.startswith("joint."):
            each = tuple(axis for axis in AXES if axis.endswith("_rotation"))
        else:
            each = LEGS if self.number.startswith(("each_leg.", "leg.")) else AXES
        return tuple(self.number.replace("*", one) for one in each)

    def draw(self, name: str, seed: int) -> float | None:
        """The draw for one number; None where this machine does not have it."""
        rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
        low, high = self.range
        if self.spread == "triangular":
            drawn = float(rng.triangular(low, 0.5 * (low + high), high))
        else:
            drawn = float(rng.uniform(low, high))
        if self.chance == 1.0:
            return drawn
        place = name.rpartition(".")[0]  # an effect's parameters are there together
        present = np.random.default_rng([seed, zlib.crc32(f"{place} exists".encode())]).random()
        return drawn if present < self.chance else None

    def times(self, name: str, scale: Scale) -> float:
        """What the range grows by on a machine of this size: offsets and errors do with their unit,
        shares and factors do not.
        """
        turns = self.unit == "m or rad" and "_rotation" in name
        unit = "rad" if turns else self.unit.partition(" or ")[0]
        grows = self.by != "factor" and unit in OF_SIZE
        return float(scale.length ** exponent(unit)) if grows else 1.0

    def believes(self, name: str, declared: float, scale: Scale) -> bool:
        """Whether this says what to expect of a number that is `declared` so."""
        return self.about is None or math.isclose(declared, self.times(name, scale) * self.about)

    def moments(self) -> tuple[float, float]:
        """Mean and standard deviation of a draw; where not every machine has it, of all."""
        low, high = self.range
        middle = 0.5 * (low + high)
        variance = (high - low) ** 2 / (24.0 if self.spread == "triangular" else 12.0)
        none = 1.0 if self.by == "factor" else 0.0
        mean = none + self.chance * (middle - none)
        second = self.chance * (variance + (middle - none) ** 2)
        return mean, math.sqrt(second - (mean - none) ** 2)

    def standard_deviation(self, name: str, drawing: float, scale: Scale) -> float:
        """Of the number of that name on machines of this size, in its unit."""
        times = drawing if self.by == "factor" else self.times(name, scale)
        return abs(times) * self.moments()[1]

    def applied(self, drawing: float, drawn: float) -> float:
        """The true number."""
        if self.by == "value":
            return drawn
        return drawing * drawn if self.by == "factor" else drawing + drawn


class Tolerances(Checked):
    """A tolerance file."""

    tolerances: Annotated[tuple[Tolerance, ...], Sequence] = Field(min_length=1)


@dataclass(frozen=True)
class Drawn:
    """One drawn machine. `numbers`: every true number by name, with its unit, as `testbed
    commission` names them.
    """

    changes: dict[str, float] = field(default_factory=dict)
    """Path of a machine's number -> its true value."""
    undeclared: tuple[Undeclared, ...] = ()
    ground_stiffness_factor: float = 1.0
    numbers: dict[str, dict[str, Any]] = field(default_factory=dict)


def tolerances(name: str) -> tuple[Tolerance, ...]:
    """The shipped tolerance file of that name. Raises InputError for a file that cannot be
    understood.
    """
    path = Path(testbed.machine.__file__).with_name(f"{name}.yaml")
    return _read(path)


@lru_cache(maxsize=4)
def _read(path: Path) -> tuple[Tolerance, ...]:
    return checked(Tolerances, read_mapping(path), path).tolerances


def draw_machine(name: str | None, seed: int, drawing: Machine) -> Drawn:
    """The machine that the tolerances `name` make of a drawing with this seed; None: the drawing
    itself.
    """
    if name is None:
        return Drawn()
    changes: dict[str, float] = {}
    effects: dict[tuple[str, str], dict[str, float]] = {}
    numbers: dict[str, dict[str, Any]] = {}
    factor = 1.0
    for tolerance, number, drawn in _draws(name, seed):
        drawn *= tolerance.times(number, drawing.scale)
        if number == GROUND:
            factor, unit, value = drawn, tolerance.unit, drawn
        elif "@" in number:
            effect, _, place = number.partition("@")
            place, _, parameter = place.partition(".")
            unit, value = tolerance.unit, drawn
            effects.setdefault((effect, place), {})[parameter] = drawn
        else:
            declared = drawing.quantity(number, f"{name}.yaml")
            unit, value = declared.unit, tolerance.applied(declared.value, drawn)
            changes[number] = value
        numbers[number] = {"value": value, "unit": unit}
    hidden = (
        Undeclared(effect=e, at=at, parameters=parameters)
        for (e, at), parameters in effects.items()
    )
    return Drawn(changes, tuple(hidden), factor, numbers)


def _draws(name: str, seed: int) -> Iterator[tuple[Tolerance, str, float]]:
    for tolerance in tolerances(name):
        for number in tolerance.names():
            if "@" in number and tolerance.by != "value":
                raise InputError(
                    "an effect has no drawing to differ from",
                    file=f"{name}.yaml",
                    field=number,
                    value=tolerance.by,
                    allowed="value",
                )
            drawn = tolerance.draw(number, seed)
            if drawn is not None:
                yield tolerance, number, drawn


@dataclass(frozen=True)
class Machines:
    """Truth and belief; whoever stands below the world sees the belief alone."""

    truth: Machine
    belief: Machine
    drawn: Drawn = field(default_factory=Drawn)
    """What the truth owes to tolerances, effects that only the world has among it."""


def machines_of(scenario: Scenario, file: str | Path = "scenario") -> Machines:
    """Build both. Raises InputError, naming the field of `file`, for a number that cannot be."""
    hydraulics, urdf, folder = scenario.hydraulics, scenario.robot.urdf, scenario.machine.folder
    world: dict[str, Any] = dict(hydraulics.parameters)
    if hydraulics.supply_pressure_pa is not None:
        world["power_unit.supply_pressure_pa"] = hydraulics.supply_pressure_pa
    chosen = scenario.machine.set
    drawing = build_machine(
        world, urdf=urdf, folder=folder, file=file, section="hydraulics.parameters", of_set=chosen
    )
    drawn = draw_machine(scenario.machine.draw, scenario.machine.seed, drawing)
    truth = drawing.replaced(drawn.changes, source="drawn from tolerances")
    belief = build_machine(
        scenario.model.parameters,
        urdf=urdf if scenario.model.urdf is None else scenario.model.urdf,
        folder=folder,
        file=file,
        section="model.parameters",
        of_set=chosen,
    )
    return Machines(truth, belief, drawn)
