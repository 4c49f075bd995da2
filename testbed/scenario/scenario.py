"""Scenario files: ground, posture, task and duration, read into one frozen, checked object."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from testbed.errors import InputError, naming
from testbed.formats.checked import Checked, Numbers, Sequence, checked, impossible
from testbed.formats.sockets import is_user_class, split_user_class
from testbed.formats.yaml_files import parse_yaml, read_yaml
from testbed.machine.folder import machine_folder
from testbed.machine.model import Machine
from testbed.machine.names import LEGS
from testbed.machine.ruled import check_effective, check_kind
from testbed.machine.urdf_check import lacking
from testbed.resources import scenario as scenario_path
from testbed.scenario.drilling import DrillHole
from testbed.scenario.events import Event, LiftFoot, Payload, SetRope, Stop, Turn
from testbed.scenario.machines import machines_of
from testbed.scenario.parts import (
    Control,
    Estimator,
    Expect,
    Hydraulics,
    Model,
    Mutation,
    OwnMachine,
    Rates,
    Robot,
    Ropes,
    Sensors,
    Terrain,
    Undeclared,
)
from testbed.scenario.tasks import Chain, Crawl, Drill, Program, Raise, RodChange, Stand, Sway, Task

FORMAT = "roboclimber-scenario/1"


class Scenario(Checked):
    """One scenario, checked and frozen."""

    format: Literal["roboclimber-scenario/1"] = Field(description="format of the file")
    name: str = Field(
        min_length=1,
        max_length=80,
        pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$",
        description="short name; folders are called after it",
    )
    description: str = Field(default="", description="what it is for, one or two sentences")
    seed: int = Field(
        default=0, ge=0, le=2**32 - 1, description="seed of everything random in the run"
    )
    duration_s: float = Field(default=10.0, gt=0, le=90_000, description="simulated time [s]")
    rates: Rates = Rates()
    terrain: Terrain = Terrain()
    machine: OwnMachine = OwnMachine()
    robot: Robot = Robot()
    ropes: Ropes = Ropes()
    hydraulics: Hydraulics = Hydraulics()
    sensors: Sensors = Sensors()
    task: Task = Stand()
    events: Annotated[tuple[Event, ...], Sequence] = Field(
        default=(), description="things that happen at a given time"
    )
    control: Control = Control()
    model: Model = Model()
    estimator: Estimator = Estimator()
    undeclared: Annotated[tuple[Undeclared, ...], Sequence] = Field(
        default=(), description="effects of the world that the model lacks"
    )
    expect: Expect = Expect()
    mutation: Mutation | None = Field(
        default=None,
        description="a change under which `expect` must fail; tests apply it, a run does not",
    )

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
        if isinstance(self.task, Crawl | Sway | Program | Chain):
            for event in self.events:
                if isinstance(event, LiftFoot | SetRope):
                    raise impossible(
                        f"events: {event.kind} moves what the task {self.task.kind} moves itself",
                        "it in tasks that hold or raise the body",
                    )
        return self

    @property
    def tolerances(self) -> str | None:
        """How far the machine may be from what is believed of it: a tolerance file's name; None: it
        is as believed.
        """
        chosen = self.model.tolerances or self.machine.draw
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
        """What tasks and events take off the rod store, kg."""
        taken = sum(max(-e.mass_kg, 0.0) for e in self.events if isinstance(e, Payload))
        task = self.drilling
        if isinstance(task, Drill):
            laps = 1
            if task.repeat:
                lap_s = sum(p.duration_s for p in task.phases)
                laps = math.ceil(max(self.duration_s - task.start_s, 0.0) / lap_s)
            taken += laps * sum(p.rod_kg for p in task.phases if isinstance(p, RodChange))
        return taken


def load_scenario(
    path_or_name: str | Path,
    overrides: list[str] | tuple[str, ...] = (),
    seed: int | None = None,
    duration: float | None = None,
) -> Scenario:
    """Read a scenario file (or a shipped one by name), with changes `a.b=c` applied before it is
    checked.

    Raises InputError (file, dotted field, value, what is allowed) for anything that cannot be used.
    """
    path = scenario_path(path_or_name)
    data = read_yaml(path)
    if not isinstance(data, dict):
        raise InputError(
            "must be a mapping of keys to values",
            file=path,
            allowed=f"format: {FORMAT} and the scenario's keys",
        )
    data.setdefault("name", path.stem)
    for override in overrides:
        _override(data, override)
    if seed is not None:
        data["seed"] = seed
    if duration is not None:
        data["duration_s"] = duration
    _chain(data, path)
    _find_machine(data, path)
    _find_file(data, path, "robot", "urdf")
    _find_file(data, path, "model", "urdf")
    _find_file((data.get("terrain") or {}), path, "elevation", "file", "terrain.")
    for task, place in _raw_tasks(data):
        _find_class({place: task}, path, place, "file")
    _find_class(data, path, "control", "distribution")
    scenario = _on_its_slope(checked(Scenario, data, path))
    _check_effect(scenario.hydraulics.parameters, path, "hydraulics.parameters")
    _check_one_supply(scenario.hydraulics, path)
    _check_effect(scenario.model.parameters, path, "model.parameters")
    truth = machines_of(scenario, path).truth
    for number, value in scenario.hydraulics.parameters.items():
        check_kind(number, value, truth, path, "hydraulics.parameters")
    _check_has(scenario, truth, path)
    _check_store(scenario, truth, path)
    _check_posture(scenario.robot, truth, path)
    _check_raise(scenario, truth, path)
    return scenario


def _chain(data: dict[str, Any], path: Path) -> None:
    """Spell `tasks: [...]` as the task that it stands for."""
    if "tasks" not in data:
        return
    if "task" in data:
        raise InputError("beside task", file=path, field="tasks", allowed="one of both")
    data["task"] = {"kind": "chain", "tasks": data.pop("tasks")}


def _raw_tasks(data: Any) -> list[tuple[Any, str]]:
    """The task of a raw tree, or those of its chain, each with its place."""
    task = data.get("task")
    parts = task.get("tasks") if isinstance(task, dict) else None
    if isinstance(parts, list):
        return [(part, f"task.tasks.{k}") for k, part in enumerate(parts)]
    return [(task, "task")]


def _find_machine(data: Any, path: Path) -> None:
    """Make the folder of a machine of the user's own absolute; two URDFs are refused."""
    part = data.get("machine")
    if not isinstance(part, dict) or not isinstance(part.get("folder"), str):
        return
    if (data.get("robot") or {}).get("urdf") is not None:
        raise InputError(
            "beside machine.folder, which has a URDF of its own",
            file=path,
            field="robot.urdf",
            allowed="one of both",
        )
    with naming(path):
        part["folder"] = str(machine_folder(part["folder"], path.parent))


def _find_file(data: Any, path: Path, section: str, key: str, prefix: str = "") -> None:
    """Make a relative file name in the raw tree absolute: it counts from the scenario file's
    folder.
    """
    part = data.get(section) if isinstance(data, dict) else None
    if isinstance(part, dict) and isinstance(part.get(key), str):
        file = (path.parent / part[key]).resolve()
        if not file.is_file():
            raise InputError(
                "no such file",
                file=path,
                field=f"{prefix}{section}.{key}",
                value=part[key],
                allowed="a file",
            )
        part[key] = str(file)


def _find_class(data: Any, path: Path, section: str, key: str) -> None:
    """Make the file of a class of the user's own absolute: it counts from the scenario's folder,
    then from here.
    """
    part = data.get(section) if isinstance(data, dict) else None
    if not isinstance(part, dict):
        return
    name = part.get(key)
    if isinstance(name, str) and is_user_class(name):
        with naming(path):
            file, found = split_user_class(
                name, field=f"{section}.{key}", folders=(path.parent, Path())
            )
        part[key] = f"{file}:{found}"


def _on_its_slope(scenario: Scenario) -> Scenario:
    """Where the ground comes from an elevation file in the world's frame, its slope is the
    file's.
    """
    terrain = scenario.terrain
    if terrain.elevation is None:
        return scenario
    from testbed.scenario.elevation_slope import slope_of

    changed = terrain.model_copy(update={"slope_deg": slope_of(terrain)})
    return scenario.model_copy(update={"terrain": changed})


def _check_effect(changes: Numbers, file: Path, section: str) -> None:
    """Refuse a change of a number that does nothing."""
    for name, value in changes.items():
        check_effective(name, value, section.startswith("model."), file, section)


def _check_one_supply(hydraulics: Hydraulics, file: Path) -> None:
    """Refuse two set pressures of the pump."""
    path = "power_unit.supply_pressure_pa"
    if hydraulics.supply_pressure_pa is not None and path in hydraulics.parameters:
        raise InputError(
            "would have no effect: hydraulics.supply_pressure_pa rules it",
            file=file,
            field=f"hydraulics.parameters.{path}",
            value=hydraulics.parameters[path],
            allowed="one of both",
        )


def lacks(scenario: Scenario) -> set[str]:
    """What a scenario's machine does not have of drill, rod store and traction devices, by their
    links.
    """
    return lacking(machines_of(scenario).belief.urdf)


def _check_posture(robot: Robot, machine: Machine, file: Path) -> None:
    """Refuse a start posture beyond the machine's strokes and ranges."""
    for leg, radial_m, vertical_m, angle_deg in zip(
        LEGS, robot.radial_m, robot.vertical_m, robot.rotation_deg, strict=True
    ):
        for joint, extension_m in (("radial", radial_m), ("vertical", vertical_m)):
            travel_m = machine.axes[f"{leg}_{joint}"].travel_m
            if not 0.0 <= extension_m <= travel_m:
                raise InputError(
                    f"is outside the cylinder's stroke at {leg}",
                    file=file,
                    field=f"robot.{joint}_m",
                    value=extension_m,
                    allowed=f"0 to {travel_m:g} m",
                )
        ends = machine.axes[f"{leg}_rotation"].limits.ends
        lower_deg, upper_deg = (math.degrees(end) for end in ends)
        if not lower_deg - 1e-9 <= angle_deg <= upper_deg + 1e-9:
            raise InputError(
                f"is outside the joint's range at {leg}",
                file=file,
                field="robot.rotation_deg",
                value=angle_deg,
                allowed=f"{lower_deg:g} to {upper_deg:g} deg",
            )


def _check_raise(scenario: Scenario, machine: Machine, file: Path) -> None:
    """Refuse to raise the body further than the vertical cylinders go."""
    task = scenario.task
    tasks = task.tasks if isinstance(task, Chain) else (task,)
    stroke_m = min(machine.axes[f"{leg}_vertical"].travel_m for leg in LEGS)
    for part in tasks:
        if isinstance(part, Raise) and part.to_m > stroke_m:
            raise InputError(
                "is beyond the vertical cylinders' stroke",
                file=file,
                field="task.to_m",
                value=part.to_m,
                allowed=f"at most {stroke_m:g} m",
            )


def _check_has(scenario: Scenario, machine: Machine, file: Path) -> None:
    """Refuse ropes, a drill or a load where the machine has nothing to hold them."""
    lacks = lacking(machine.urdf)
    wanted = (
        (
            "traction_left",
            scenario.ropes.enabled,
            "ropes.enabled",
            "false: the machine has no ropes",
        ),
        ("drill_mast", scenario.drilling is not None, "task", "one that does not drill"),
        ("rod_store", scenario.carried_kg > 0.0, "robot.payload_kg", "0: it has no rod store"),
    )
    for link, asked, field, allowed in wanted:
        if asked and link in lacks:
            raise InputError(f"the machine has no {link}", file=file, field=field, allowed=allowed)


def _check_store(scenario: Scenario, machine: Machine, file: Path) -> None:
    """Refuse to take more off the rod store than it weighs."""
    taken, held = scenario.taken_kg, scenario.carried_kg + machine.rod_store_body.mass_kg
    if taken >= held:
        raise InputError(
            f"{taken:g} kg are taken off a rod store of {held:g} kg",
            file=file,
            allowed="less of it, or a larger robot.payload_kg",
        )


def _override(data: dict[str, Any], text: str) -> None:
    """Put `a.b=c` into the raw tree; `c` is YAML; a number in the path counts a list's entries from
    0.
    """
    path, equals, value_text = text.partition("=")
    keys = path.strip().split(".")
    if not equals or not all(keys):
        raise InputError(
            "is not an assignment",
            file="--set",
            value=None,
            field=text or "''",
            allowed="a.b=c, such as terrain.slope_deg=60",
        )
    value = parse_yaml(value_text, f"--set {path}")
    node: Any = data
    while len(keys) > 1 and keys[0] != "parameters":
        key = keys.pop(0)
        if isinstance(node, list):
            node = node[_entry(node, key, text)]
        elif isinstance(node, dict):
            if node.get(key) is None:
                node[key] = {}
            node = node[key]
        else:
            raise InputError(
                "has no parts",
                file="--set",
                field=text,
                allowed="the path of a value in the scenario",
            )
    if (
        keys[0] == "parameters" and len(keys) > 1 and isinstance(node, dict)
    ):  # a dotted parameter path is one key
        group = node.setdefault("parameters", {})
        if not isinstance(group, Mapping):
            raise InputError(
                "has no parts",
                file="--set",
                field=text,
                allowed="the path of a value in the scenario",
            )
        node, keys = group, [".".join(keys[1:])]
    if isinstance(node, list):
        node[_entry(node, keys[0], text)] = value
    elif isinstance(node, dict):
        node[keys[0]] = value
    else:
        raise InputError(
            "has no parts", file="--set", field=text, allowed="the path of a value in the scenario"
        )


def _entry(node: list[Any], key: str, text: str) -> int:
    if not key.isdigit() or int(key) >= len(node):
        raise InputError(
            "no such entry",
            file="--set",
            field=text,
            allowed=f"0 to {len(node) - 1}" if node else "nothing: the list is empty",
        )
    return int(key)
