"""A scenario's tree before it is checked: changes from outside, and files from its own folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from testbed.errors import InputError
from testbed.scenario.raw import locate, put, spell_chain


def changed(tree: dict[str, Any], *changes: str) -> dict[str, Any]:
    for change in changes:
        put(tree, change)
    return tree


def test_a_change_makes_the_parts_on_its_way() -> None:
    assert changed({}, "terrain.slope_deg=60", "terrain.friction=0.4") == {
        "terrain": {"slope_deg": 60, "friction": 0.4}
    }
    assert changed({"terrain": None}, "terrain.slope_deg=1")["terrain"] == {"slope_deg": 1}


def test_the_value_is_yaml_and_may_hold_an_equals_sign() -> None:
    assert changed({}, "a=[1, 2]", "b={c: null}", "d=x=y", "e='7'") == {
        "a": [1, 2],
        "b": {"c": None},
        "d": "x=y",
        "e": "7",
    }


def test_a_number_counts_the_entries_of_a_list() -> None:
    tree: dict[str, Any] = {"events": [{"at_s": 1.0}, {"at_s": 2.0}]}
    assert changed(tree, "events.1.at_s=5", "events.0=null") == {"events": [None, {"at_s": 5}]}


def test_the_path_of_a_parameter_is_one_key() -> None:
    tree = changed({}, "hydraulics.parameters.rope.stiffness=1", "model.parameters.a=2")
    assert tree == {
        "hydraulics": {"parameters": {"rope.stiffness": 1}},
        "model": {"parameters": {"a": 2}},
    }
    assert changed({}, "model.parameters={a: 3}") == {"model": {"parameters": {"a": 3}}}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("slope", "is not an assignment"),
        ("a..b=1", "is not an assignment"),
        ("=1", "is not an assignment"),
        ("name.part=1", "has no parts"),
        ("name.part.more=1", "has no parts"),
        ("list.2.x=1", "no such entry.*allowed: 0 to 1"),
        ("list.-1=1", "no such entry"),
        ("empty.0=1", "the list is empty"),
        ("model.parameters.x=1", "has no parts"),
    ],
)
def test_a_change_of_what_is_not_there_is_refused(change: str, said: str) -> None:
    tree = {"name": "x", "list": [1, 2], "empty": [], "model": {"parameters": 5}}
    with pytest.raises(InputError, match=said) as error:
        put(tree, change)
    assert str(error.value).startswith("--set")


def test_tasks_stand_for_a_chain_and_not_beside_a_task(tmp_path: Path) -> None:
    tree: dict[str, Any] = {"tasks": [{"kind": "stand"}]}
    spell_chain(tree, tmp_path)
    assert tree == {"task": {"kind": "chain", "tasks": [{"kind": "stand"}]}}
    with pytest.raises(InputError, match="beside task"):
        spell_chain({"tasks": [], "task": {}}, tmp_path)


def test_files_count_from_the_scenarios_folder(tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    (tmp_path / "own/robot.urdf").write_text("<robot/>")
    (tmp_path / "mine.py").write_text("class Gait: ...")
    tree: dict[str, Any] = {
        "robot": {"urdf": "own/robot.urdf"},
        "task": {"kind": "chain", "tasks": [{"kind": "program", "file": "mine.py:Gait"}]},
        "control": {"distribution": "qp"},
    }
    locate(tree, tmp_path / "scenario.yaml")
    assert tree["robot"]["urdf"] == str(tmp_path / "own/robot.urdf")
    assert tree["task"]["tasks"][0]["file"] == f"{tmp_path / 'mine.py'}:Gait"
    assert tree["control"] == {"distribution": "qp"}


@pytest.mark.parametrize("robot", ["word", 1.0, [], None])
def test_a_part_that_is_no_mapping_is_left_to_the_check(tmp_path: Path, robot: object) -> None:
    tree = {"machine": {"folder": "quarter_model"}, "robot": robot, "terrain": robot}
    locate(tree, tmp_path / "a.yaml")
    assert tree["robot"] == tree["terrain"] == robot


@pytest.mark.parametrize(
    ("tree", "field"),
    [
        ({"robot": {"urdf": "no.urdf"}}, "robot.urdf"),
        ({"model": {"urdf": "no.urdf"}}, "model.urdf"),
        ({"terrain": {"elevation": {"file": "no.npy"}}}, "terrain.elevation.file"),
        ({"machine": {"folder": "climber_8t"}, "robot": {"urdf": "a"}}, "robot.urdf"),
    ],
)
def test_a_file_that_is_not_there_is_named_by_its_field(
    tmp_path: Path, tree: dict[str, Any], field: str
) -> None:
    with pytest.raises(InputError) as error:
        locate(tree, tmp_path / "scenario.yaml")
    assert field in str(error.value) and "scenario.yaml" in str(error.value)
