"""The two machines of a scenario: the one of the world, and the one that estimators and control
believe in.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from testbed.machine.build import build_machine
from testbed.machine.model import Machine
from testbed.scenario.drawn import Drawn, draw_machine

if TYPE_CHECKING:
    from testbed.scenario.scenario import Scenario


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
