"""Scenario files: ground, posture, task and duration, read into one frozen, checked object."""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from itertools import accumulate
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from testbed.errors import InputError
from testbed.formats.checked import Checked, Sequence, checked, impossible
from testbed.formats.yaml_files import read_yaml
from testbed.machine.urdf_check import lacking
from testbed.resources import scenario as scenario_path
from testbed.scenario.drilling import DrillHole
from testbed.scenario.events import Event, Expect, LiftFoot, Mutation, Payload, SetRope, Stop, Turn
from testbed.scenario.feasibility import check_feasible, overruled_fields
from testbed.scenario.machines import WORKSHOP, machines_of
from testbed.scenario.parts import (
    Control,
    Estimator,
    Hydraulics,
    Model,
    OwnMachine,
    Rates,
    Robot,
    Ropes,
    Sensors,
    Undeclared,
)
from testbed.scenario.raw import fill_in, locate, put, spell_chain
from testbed.scenario.tasks import (
    Chain,
    Commission,
    Crawl,
    Drill,
    Program,
    RodChange,
    Stand,
    Sway,
    Task,
)
from testbed.scenario.terrain import Terrain

FORMAT = "roboclimber-scenario/1"


class Scenario(Checked):
    """One scenario, checked and frozen."""

    format: Literal["roboclimber-scenario/1"]
    """format of the file"""
    name: str = Field(min_length=1, max_length=80, pattern=r"^[^\W_][\w.-]*$")
    """short name; folders are called after it; the file's, where none is given"""
    description: str = ""
    """what it is for, one or two sentences"""
    seed: int = Field(default=0, ge=0, le=2**32 - 1)
    """seed of everything random in the run"""
    duration_s: float = Field(default=10.0, gt=0, le=90_000)
    """simulated time [s]"""
    rates: Rates = Rates()
    terrain: Terrain = Terrain()
    machine: OwnMachine = OwnMachine()
    robot: Robot = Robot()
    ropes: Ropes = Ropes()
    hydraulics: Hydraulics = Hydraulics()
    sensors: Sensors = Sensors()
    task: Task = Stand()
    events: Annotated[tuple[Event, ...], Sequence] = ()
    """things that happen at a given time"""
    control: Control = Control()
    model: Model = Model()
    estimator: Estimator = Estimator()
    undeclared: Annotated[tuple[Undeclared, ...], Sequence] = ()
    """effects of the world that the model lacks"""
    expect: Expect = Expect()
    mutation: Mutation | None = None
    """a change under which `expect` must fail; tests apply it, a run does not"""

    @model_validator(mode="after")
    def _events_can_happen(self) -> Scenario:
        tasks = self.task.tasks if isinstance(self.task, Chain) else (self.task,)
        walks = any(isinstance(task, Crawl) for task in tasks)
        for event in self.events:
            if isinstance(event, Stop | Turn) and not walks:
                raise impossible(
                    f"events: {event.kind} with nothing that walks", "a task that crawls"
                )
        if isinstance(self.task, Stand | Sway) and self.task.for_s is not None:
            raise impossible("task.for_s: a task alone goes on to the end", "duration_s")
        if isinstance(self.task, Commission | Crawl | Sway | Program | Chain):
            for event in self.events:
                if isinstance(event, LiftFoot | SetRope):
                    raise impossible(
                        f"events: {event.kind} moves what the task {self.task.kind} moves itself",
                        "it in tasks that hold or raise the body",
                    )
        return self

    @property
    def tolerances(self) -> str | None:
        """How far the robot thinks that its machine may be from what is believed of it: a tolerance
        file's name; None: it is as believed. What the world's machine is makes no difference: a
        robot does not know that it was built to the drawing.
        """
        chosen = self.model.tolerances or self.machine.draw or WORKSHOP
        return None if chosen == "exact" else chosen

    @property
    def drilling(self) -> Drill | DrillHole | None:
        """The task that drills, if any does."""
        if isinstance(self.task, Chain):
            return self.task.drilling
        return self.task if isinstance(self.task, Drill | DrillHole) else None

    @property
    def carried_kg(self) -> float:
        """What the rod store carries at the start: the payload, and the rods of a hole to be
        drilled, kg.
        """
        return self.robot.payload_kg + (
            self.drilling.stored_kg if isinstance(self.drilling, DrillHole) else 0.0
        )

    @property
    def taken_kg(self) -> float:
        """The most that tasks and events have taken off the rod store at any time, kg: what is put
        on it before may be taken off again.
        """
        loads = sorted((e for e in self.events if isinstance(e, Payload)), key=lambda e: e.at_s)
        taken = max(0.0, *(-kg for kg in accumulate((e.mass_kg for e in loads), initial=0.0)))
        task = self.drilling
        if isinstance(task, Drill):
            laps = 1
            if task.repeat:
                lap_s = sum(p.duration_s for p in task.phases)
                laps = math.ceil(max(self.duration_s - task.start_s, 0.0) / lap_s)
            taken += laps * sum(p.rod_kg for p in task.phases if isinstance(p, RodChange))
        elif isinstance(task, DrillHole):
            taken += (task.rods_at_end - task.rods_at_start) * task.rod_kg
        return taken


def _name_of(path: Path) -> str:
    """A file's name as a scenario's: other signs than letters, digits and `_.-` become `_`."""
    return re.sub(r"[^\w.-]+", "_", path.stem).strip("_.-") or "scenario"


def load_scenario(
    path_or_name: str | Path,
    overrides: Collection[str] = (),
    seed: int | None = None,
    duration: float | None = None,
) -> Scenario:
    """Read a scenario file (or a shipped one by name), with changes `a.b=c` applied before it is
    checked.

    Raises InputError (file, dotted field, value, what is allowed) for anything that cannot be used.
    """
    if not isinstance(path_or_name, str | Path):
        raise InputError(
            "cannot be used", field="scenario", value=path_or_name, allowed="a path or a name"
        )
    if isinstance(overrides, str):
        raise InputError(
            "is one text", field="overrides", value=overrides, allowed="a list of texts a.b=c"
        )
    path = scenario_path(path_or_name)
    data = read_yaml(path)
    if not isinstance(data, dict):
        raise InputError(
            "is empty" if data is None else "must be a mapping of keys to values",
            file=path,
            value=data,
            allowed=f"format: {FORMAT} and the scenario's keys",
        )
    data.setdefault("name", _name_of(path))
    for change in overrides:
        put(data, change)
    if seed is not None:
        data["seed"] = seed
    if duration is not None:
        data["duration_s"] = duration
    spell_chain(data, path)
    locate(data, path)
    fill_in(data)
    scenario = checked(Scenario, data, path)
    changes = {change.partition("=")[0].strip() for change in overrides}
    if idle := overruled_fields(scenario, _given(scenario), changes, path):
        scenario = checked(Scenario, _without(scenario, idle), path)
    scenario = _on_its_slope(scenario, path)
    check_feasible(scenario, path)
    return scenario


def _given(scenario: Scenario) -> dict[str, Any]:
    """What a file and changes give of a scenario's sections: `section.field`, and numbers of the
    machine by their whole path.
    """
    given: dict[str, Any] = {}
    for name, section in scenario:
        if isinstance(section, Checked):
            given |= {
                f"{name}.{field}": getattr(section, field) for field in section.model_fields_set
            }
    numbers = scenario.hydraulics.parameters
    return given | {f"hydraulics.parameters.{number}": value for number, value in numbers.items()}


def _without(scenario: Scenario, fields: Collection[str]) -> dict[str, Any]:
    """The tree of a scenario in which these fields are as they are by default."""
    data = scenario.model_dump(exclude_unset=True)
    for field in fields:
        section, key, *number = field.split(".", 2)
        if number:
            del data[section][key][number[0]]
        else:
            del data[section][key]
    return data


def _on_its_slope(scenario: Scenario, file: Path) -> Scenario:
    """Where the ground comes from an elevation file in the world's frame, its slope is the file's.
    Raises InputError where the scenario says another one.
    """
    terrain = scenario.terrain
    if terrain.elevation is None:
        return scenario
    from testbed.scenario.elevation import slope_of

    slope_deg = slope_of(terrain)
    if terrain.slope_deg != 0.0 and not math.isclose(terrain.slope_deg, slope_deg, rel_tol=1e-6):
        raise InputError(
            "would have no effect: terrain.elevation rules it",
            file=file,
            field="terrain.slope_deg",
            value=terrain.slope_deg,
            allowed=f"the file's own, {slope_deg:.4g}, or terrain.elevation.frame: slope",
        )
    changed = terrain.model_copy(update={"slope_deg": slope_deg})
    return scenario.model_copy(update={"terrain": changed})


def lacks(scenario: Scenario) -> set[str]:
    """What a scenario's machine does not have of drill, rod store and traction devices, by their
    links.
    """
    return lacking(machines_of(scenario).belief.urdf)
