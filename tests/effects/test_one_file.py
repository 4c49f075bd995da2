"""An effect is one file: what is asked of it is answered there, and nobody else knows its name."""

from __future__ import annotations

import ast
from dataclasses import fields
from pathlib import Path

import pytest

import testbed
from testbed.effects import ALL, by_name, of_declared
from testbed.effects.base import Effect
from testbed.effects.terms import Signals
from testbed.estimation.live.believed import Leg
from testbed.recording.known import Known

PACKAGE = Path(testbed.__file__).parent
MOST_LITERALS = 20
RECORD_PATHS = {("world", "valve.deadband")}
"""The dead band among a cylinder's parameters stands at a path that reads like the effect's
name.
"""
REFERENCE = "benchmarks/reference_leg"
"""The independent leg that hides effects to judge the diagnosis by: it must not ask the objects it
judges.
"""


def test_names_of_effects_stand_in_their_files_and_hardly_anywhere_else() -> None:
    names = {effect.kind for effect in ALL}
    found = []
    for path in PACKAGE.rglob("*.py"):
        where = path.relative_to(PACKAGE).as_posix()
        if where.startswith("effects/"):
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if (where.split("/")[0], getattr(node, "value", None)) in RECORD_PATHS:
                continue
            if isinstance(node, ast.Constant) and node.value in names:
                found.append(f"{where}:{node.lineno} {node.value}")
    assert len(found) <= MOST_LITERALS, found
    assert all(line.startswith(REFERENCE) for line in found), found


def test_every_file_of_the_folder_with_effects_is_in_the_list() -> None:
    folder = PACKAGE / "effects"
    declared = [p for p in folder.glob("*.py") if "\nEFFECTS = (" in p.read_text()]
    modules = {type(effect).__module__.rpartition(".")[2] for effect in ALL}
    assert {p.stem for p in declared} == modules
    for effect in ALL:
        assert effect.kind.split(".")[0] == type(effect).__module__.rpartition(".")[2].split("_")[0]


@pytest.mark.parametrize("effect", ALL, ids=lambda effect: effect.kind)
def test_what_an_effect_says_of_others_is_true_of_them(effect: Effect) -> None:
    assert effect.equation and effect.text and effect.parameters and effect.places
    parameters = {spec.name for spec in effect.parameters}
    assert {*effect.shapes, *effect.live} <= parameters
    assert all(effect.spec(shape).default is not None for shape in effect.shapes)
    assert effect.band_amplitude is None or effect.band_amplitude in parameters
    assert set(effect.live.values()) <= {field.name for field in fields(Leg)}
    assert set(effect.alike) <= {other.kind for other in ALL} - {effect.kind}
    assert effect.declared_as is None or effect.declared_as in Known.model_fields
    channels = {field.name for field in fields(Signals)}
    assert all(any(c.startswith(f"{need}") for c in channels) for need in effect.needs)
    for spec in effect.parameters:
        low, high = spec.prior
        assert spec.low <= low < high <= spec.high and spec.unit and spec.text
        assert not spec.log or low > 0.0


def test_an_effect_that_a_single_axis_shows_changes_a_balance_or_a_sensor() -> None:
    for effect in ALL:
        believed = any(effect.overrides(term) for term in ("correct", "force", "flow"))
        assert believed == bool(effect.rigs), effect.kind
        assert not effect.overrides("force") or "force" in effect.seen_in
        assert not effect.overrides("flow") or "flow" in effect.seen_in
        assert bool(effect.telling_motion) or not effect.rigs


def test_the_effect_of_a_declared_number_is_found_by_the_number() -> None:
    assert of_declared("valve_deadband") is by_name("valve.deadband")


def test_an_effect_at_a_place_is_another_object_with_another_name() -> None:
    placed = by_name("sensor.gain_a").at("fl_vertical")
    assert placed.name == "sensor.gain_a@fl_vertical"
    assert by_name("sensor.gain_a").name == placed.kind == "sensor.gain_a"
    assert {c.owner for c in placed.coordinates()} == {placed.name}
