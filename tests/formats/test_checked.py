"""The manners of every checked object: what is refused, in which words, at which field of which
file.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

import pytest
from pydantic import Field, ValidationError, field_validator, model_validator

from testbed.errors import InputError
from testbed.formats.checked import (
    Checked,
    Four,
    NameOrClass,
    Names,
    Numbers,
    Pair,
    checked,
    impossible,
)


class Stand(Checked):
    kind: Literal["stand"] = "stand"
    seconds: float = Field(gt=0.0, le=100.0)


class Walk(Checked):
    kind: Literal["walk"] = "walk"
    steps: int = Field(default=4, ge=1)


class Machine(Checked):
    mass_kg: float
    heights_m: Four = (0.3, 0.3, 0.3, 0.3)
    span_m: Pair = (0.0, 1.0)
    words: Names = ()
    numbers: Numbers = Field(default_factory=dict)
    gait: Annotated[str, NameOrClass(("wave", "crawl"))] = "wave"
    drilling: bool = False
    task: Annotated[Stand | Walk, Field(discriminator="kind")] = Walk()

    @field_validator("mass_kg")
    @classmethod
    def _not_weightless(cls, value: float) -> float:
        if value == 0.0:
            raise impossible("is weightless", "more than 0 kg")
        return value

    @model_validator(mode="after")
    def _rising(self) -> Machine:
        if self.span_m[0] >= self.span_m[1]:
            raise ValueError("the span does not rise")
        return self


def made(**changes: Any) -> Machine:
    return checked(Machine, {"mass_kg": 4000.0} | changes, "case.yaml")


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"mas_kg": 1.0}, "case.yaml: mas_kg: unknown key, did you mean 'mass_kg'? (allowed: "),
        ({"task": {"kind": "walk", "step": 3}}, "task.step: unknown key, did you mean 'steps'?"),
        ({"mass_kg": "heavy"}, "mass_kg = 'heavy': cannot be used (allowed: a number)"),
        ({"mass_kg": None}, "mass_kg = 'nothing': cannot be used (allowed: a number)"),
        ({"mass_kg": True}, "mass_kg = True: cannot be used"),
        ({"mass_kg": float("inf")}, "mass_kg = inf: is out of range (allowed: a finite number)"),
        ({"mass_kg": 0.0}, "mass_kg = 0.0: is weightless (allowed: more than 0 kg)"),
        ({"drilling": 1}, "drilling = 1: cannot be used (allowed: true or false)"),
        ({"heights_m": [1.0, 2.0]}, "heights_m"),
        ({"span_m": [2.0, 1.0]}, "the span does not rise"),
        ({"task": {}}, "task.kind: is missing (allowed: one of the known kinds)"),
        ({"task": {"kind": "wlak"}}, "task.kind = 'wlak': unknown kind, did you mean 'walk'?"),
        ({"task": {"kind": "stand"}}, "task.seconds: is missing"),
        (
            {"task": {"kind": "stand", "seconds": 0.0}},
            "task.seconds = 0.0: is out of range (allowed: more than 0)",
        ),
        ({"task": {"kind": "stand", "seconds": 101.0}}, "is out of range (allowed: at most 100)"),
        ({"task": {"kind": "walk", "steps": 2.5}}, "task.steps = 2.5: cannot be used"),
        (
            {"gait": "wvae"},
            "gait = 'wvae': no such name, did you mean 'wave'? (allowed: wave | crawl | ",
        ),
        ({"words": "one"}, "words = 'one': cannot be used (allowed: a list)"),
    ],
)
def test_what_cannot_be_is_one_line_that_names_field_value_and_what_is_allowed(
    changes: dict[str, Any], line: str
) -> None:
    with pytest.raises(InputError) as refused:
        made(**changes)
    assert line in str(refused.value)
    assert str(refused.value).startswith("case.yaml") and "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("tree", "problem"),
    [
        (None, "case.yaml: is empty"),
        ([], r"case.yaml: \[\]: must be a mapping of keys to values"),
        ("text", "case.yaml: 'text': must be a mapping"),
        (3.0, "case.yaml: 3.0: must be a mapping"),
    ],
)
def test_a_file_that_is_no_mapping_is_refused_as_a_whole(tree: Any, problem: str) -> None:
    with pytest.raises(InputError, match=problem):
        checked(Machine, tree, "case.yaml")


def test_a_missing_number_is_missing_and_not_a_wrong_one() -> None:
    with pytest.raises(InputError, match=r"case\.yaml: mass_kg: is missing$"):
        checked(Machine, {}, "case.yaml")


def test_one_number_stands_for_four_and_a_list_for_each() -> None:
    assert made(heights_m=0.2).heights_m == (0.2, 0.2, 0.2, 0.2)
    assert made(heights_m=[0.1, 0.2, 0.3, 0.4]).heights_m == (0.1, 0.2, 0.3, 0.4)


def test_nested_numbers_become_dotted_ones() -> None:
    tree = {"axes": {"fl": {"bore_m": 0.1, "ends": [1.0, 2.0]}}, "oil.air": 0.01}
    assert made(numbers=tree).numbers == {
        "axes.fl.bore_m": 0.1,
        "axes.fl.ends": (1.0, 2.0),
        "oil.air": 0.01,
    }


@pytest.mark.parametrize("name", ["crawl", "mine.py:Mine", "folder/mine.py:Mine"])
def test_a_choice_is_a_name_or_a_class_of_ones_own(name: str) -> None:
    assert made(gait=name).gait == name


def test_what_was_checked_cannot_be_changed() -> None:
    machine = made()
    with pytest.raises(ValidationError, match="frozen"):
        machine.mass_kg = 1.0  # type: ignore[misc]
