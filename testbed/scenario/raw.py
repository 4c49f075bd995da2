"""A scenario file's tree before it is checked: short spellings, changes from outside, file names
made absolute.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from testbed.errors import InputError, naming
from testbed.formats.sockets import is_user_class, split_user_class
from testbed.formats.yaml_files import parse_yaml
from testbed.machine.folder import machine_folder, own_numbers
from testbed.machine.overridden import ruler_of
from testbed.scenario.drilling import DrillHole

FILLED = ("ropes", "hydraulics", "terrain", "task")
"""Sections of a scenario with fields that a machine may have a number for."""


def locate(data: dict[str, Any], path: Path) -> None:
    """Make all names of files in a scenario's tree absolute. Raises InputError for one that is not
    there.
    """
    _find_machine(data, path)
    _find_file(data, path, "robot", "urdf")
    _find_file(data, path, "model", "urdf")
    _find_file((data.get("terrain") or {}), path, "elevation", "file", "terrain.")
    for task, place in _raw_tasks(data):
        _find_class({place: task}, path, place, "file")
    _find_class(data, path, "control", "distribution")


def spell_chain(data: dict[str, Any], path: Path) -> None:
    """Spell `tasks: [...]` as the task that it stands for."""
    if "tasks" not in data:
        return
    if "task" in data:
        raise InputError("beside task", file=path, field="tasks", allowed="one of both")
    data["task"] = {"kind": "chain", "tasks": data.pop("tasks")}


def fill_in(data: dict[str, Any]) -> None:
    """Give fields that a scenario leaves open the numbers that its machine's own folder has for
    them: `rope.breaking_load_n` is `ropes.breaking_load_n` then.
    """
    machine = data.get("machine")
    if not isinstance(machine, dict) or not isinstance(machine.get("folder"), str):
        return
    for number, quantity in own_numbers(Path(machine["folder"])).items():
        section, _, field = (ruler_of(number, False) or "").partition(".")
        if section not in FILLED or ruler_of(number, True) != f"{section}.{field}":
            continue
        if section == "task":
            raw = [task for task, _ in _raw_tasks(data) if isinstance(task, dict)]
            drilling = [task for task in raw if task.get("kind") == "drill_hole"]
            parts = drilling if field in DrillHole.model_fields else []
        else:
            parts = [data.setdefault(section, {})]
        for part in parts:
            if isinstance(part, dict) and part.get("enabled") is not False:
                part.setdefault(field, quantity.value)


def put(data: dict[str, Any], text: str) -> None:
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
        node = _part(node, keys.pop(0), text)
    if len(keys) > 1 and isinstance(node, dict):  # a dotted parameter path is one key
        node, keys = _part(node, keys[0], text), [".".join(keys[1:])]
    if isinstance(node, list):
        node[_entry(node, keys[0], text)] = value
    elif isinstance(node, dict):
        node[keys[0]] = value
    else:
        raise _no_parts(text)


def _part(node: Any, key: str, text: str) -> Any:
    """The part of a tree by its key, made if need be."""
    if isinstance(node, list):
        return node[_entry(node, key, text)]
    if not isinstance(node, dict):
        raise _no_parts(text)
    if node.get(key) is None:
        node[key] = {}
    return node[key]


def _no_parts(text: str) -> InputError:
    allowed = "the path of a value in the scenario"
    return InputError("has no parts", file="--set", field=text, allowed=allowed)


def _entry(node: list[Any], key: str, text: str) -> int:
    if not key.isdigit() or int(key) >= len(node):
        raise InputError(
            "no such entry",
            file="--set",
            field=text,
            allowed=f"0 to {len(node) - 1}" if node else "nothing: the list is empty",
        )
    return int(key)


def _find_machine(data: Any, path: Path) -> None:
    """Make the folder of a machine of the user's own absolute; two URDFs are refused."""
    part = data.get("machine")
    if not isinstance(part, dict) or not isinstance(part.get("folder"), str):
        return
    robot = data.get("robot")
    if isinstance(robot, dict) and robot.get("urdf") is not None:
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


def _raw_tasks(data: Any) -> list[tuple[Any, str]]:
    """The task of a raw tree, or those of its chain, each with its place."""
    task = data.get("task")
    parts = task.get("tasks") if isinstance(task, dict) else None
    if isinstance(parts, list):
        return [(part, f"task.tasks.{k}") for k, part in enumerate(parts)]
    return [(task, "task")]
