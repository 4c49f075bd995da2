"""Nothing is accepted without effect: every field of a scenario, changed, changes the recording or
is refused.
"""

from __future__ import annotations

import json
import shutil
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin

import numpy as np
import pytest
import yaml
from perturbed import changes_recording
from pydantic import BaseModel
from shipped import MACHINE

from testbed.errors import InputError
from testbed.scenario.scenario import Scenario, load_scenario
from testbed.simulation.run_summary import unmet

FILES = Path(__file__).parent / "every_field"
DATA: dict[str, Any] = yaml.safe_load((FILES / "values.yaml").read_text())
Place = tuple[str, str, Any]
"""A scenario's file, the dotted path of a field in it, and the value that it has there."""


def _models(kind: Any) -> Iterator[type[BaseModel]]:
    """The checked classes that a type holds."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        yield kind
    for inner in get_args(kind):
        yield from _models(inner)


def _schema(kind: type[BaseModel], seen: dict[type[BaseModel], None]) -> None:
    if kind in seen:
        return
    seen[kind] = None
    for field in kind.model_fields.values():
        for inner in _models(field.annotation):
            _schema(inner, seen)


def every_field() -> list[str]:
    """`Class.field` of everything that a scenario may hold, save what only groups other fields."""
    seen: dict[type[BaseModel], None] = {}
    _schema(Scenario, seen)
    return [
        f"{kind.__name__}.{name}"
        for kind in seen
        for name, field in kind.model_fields.items()
        if not _is_group(field.annotation) and not _tells_the_class(name, field.annotation)
    ]


def _tells_the_class(name: str, kind: Any) -> bool:
    return name == "kind" and len(get_args(kind)) == 1


def _is_group(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _places(model: BaseModel, path: str = "") -> Iterator[tuple[str, str, Any]]:
    """(Class.field, dotted path, value) of everything that a checked scenario holds."""
    for name in type(model).model_fields:
        value, here = getattr(model, name), f"{path}{name}"
        yield f"{type(model).__name__}.{name}", here, value
        for key, inner in _inner(value):
            yield from _places(inner, f"{here}{key}.")


def _inner(value: Any) -> Iterator[tuple[str, BaseModel]]:
    if isinstance(value, BaseModel):
        yield "", value
    elif isinstance(value, tuple):
        yield from ((f".{k}", v) for k, v in enumerate(value) if isinstance(v, BaseModel))


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Place]]:
    """Where each field stands in the scenarios beside this test; those that spell its section out
    come first.
    """
    folder = tmp_path_factory.mktemp("fields") / "scenarios"
    shutil.copytree(FILES, folder)
    x, y = np.meshgrid(np.linspace(-8, 8, 161), np.linspace(-8, 8, 161), indexing="ij")
    np.save(folder / "hill.npy", 0.1 * x + 0.05 * np.sin(x) * np.cos(y))
    np.save(folder / "other.npy", 0.12 * x + 0.05 * np.cos(x) * np.sin(y))
    text = MACHINE.urdf.read_text()
    other = text.replace('<mass value="15', '<mass value="16')
    assert other != text
    (folder / "other.urdf").write_text(other)
    found: dict[str, list[tuple[int, Place]]] = {}
    for file in sorted(folder.glob("*.yaml")):
        if file.name == "values.yaml":
            continue
        tree = yaml.safe_load(file.read_text())
        for field, path, value in _places(load_scenario(file)):
            likely = 2 * _spelled(tree, path) + (file.stem == "stand")
            found.setdefault(field, []).append((likely, (str(file), path, value)))
    return {
        field: [place for _, place in sorted(those, key=lambda those: -those[0])]
        for field, those in found.items()
    }


def _spelled(tree: Any, path: str) -> bool:
    """Whether a scenario's file gives a field itself."""
    for key in path.split("."):
        try:
            tree = tree[int(key) if isinstance(tree, list) else key]
        except (KeyError, TypeError):
            return False
    return True


def _others(field: str, value: Any) -> list[str]:
    """Other values, as YAML: those that are listed, else what the type has."""
    if field in DATA["values"]:
        return [str(other) for other in DATA["values"][field]]
    if isinstance(value, bool):
        return [json.dumps(not value)]
    if isinstance(value, int):
        return [str(v) for v in (value + 1, value * 2, value // 2)]
    if isinstance(value, float):
        return [json.dumps(v) for v in (1.1 * value, 0.5 * value, value + 0.01, 3.0 * value)]
    if isinstance(value, tuple) and value and all(isinstance(v, int | float) for v in value):
        return [json.dumps([0.9 * v + 0.01 for v in value])]
    return [json.dumps(v) for v in _choices(field) if v != value]


def _choices(field: str) -> list[Any]:
    """What a field of a few names may be."""
    name, _, attribute = field.partition(".")
    seen: dict[type[BaseModel], None] = {}
    _schema(Scenario, seen)
    kind = next(k for k in seen if k.__name__ == name).model_fields[attribute].annotation
    return list(_literals(kind))


def _literals(kind: Any) -> Iterator[Any]:
    if get_origin(kind) is Literal:
        yield from get_args(kind)
    elif get_origin(kind) in (Union, types.UnionType):
        for inner in get_args(kind):
            yield from _literals(inner)


def _fate(field: str, places: list[Place]) -> str:
    """What becomes of other values of a field: changed, refused or idle."""
    fates = set()
    for file, path, value in places[:3]:
        for other in _others(field, value):
            try:
                if changes_recording((file, ()), f"{path}={other}"):
                    return "changed"
                fates.add("idle")
            except InputError:
                fates.add("refused")
    return "refused" if fates == {"refused"} else "idle"


ELSEWHERE = {*DATA["told"], *DATA["expected"]}
FIELDS = [field for field in every_field() if field not in ELSEWHERE]


@pytest.mark.long
def test_every_field_changes_the_recording_or_is_refused(places: dict[str, list[Place]]) -> None:
    assert not [field for field in FIELDS if field not in places], "in no scenario beside this test"
    fates = {field: _fate(field, places[field]) for field in FIELDS}
    idle = [field for field, fate in fates.items() if fate == "idle"]
    assert not idle, ", ".join(idle)
    assert [f for f, fate in fates.items() if fate == "refused"] == DATA["refused"]
    assert len(fates) > 100


@pytest.mark.parametrize("field", FIELDS[5::36])
def test_a_sample_of_fields_changes_the_recording_or_is_refused(
    field: str, places: dict[str, list[Place]]
) -> None:
    assert _fate(field, places[field]) == ("refused" if field in DATA["refused"] else "changed")


def test_the_lists_name_fields_that_there_are() -> None:
    assert {*DATA["values"], *ELSEWHERE, *DATA["refused"]} <= {*every_field(), "Scenario.task"}


SUMMARY = {"verdict": "stood", "tilt_max_deg": 1.0}


@pytest.mark.parametrize(
    "change",
    [
        "expect.verdict=fell",
        "expect.summary={climbed_m: {min: 1}}",
        "expect.summary.tilt_max_deg.min=2",
        "expect.summary.tilt_max_deg.max=0.5",
        "expect.summary.verdict.equals=fell",
    ],
)
def test_what_is_expected_changes_what_is_unmet(change: str) -> None:
    file = FILES / "expect.yaml"
    assert unmet(load_scenario(file).expect, SUMMARY) == []
    assert unmet(load_scenario(file, [change]).expect, SUMMARY) != []
