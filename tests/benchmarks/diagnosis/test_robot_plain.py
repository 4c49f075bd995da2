"""Plain effects in shipped scenes: every kind is there, at a size that its effect allows."""

from __future__ import annotations

from typing import Any

import pytest

from testbed.benchmarks.diagnosis.robot_draws import hidden_sizes, strokes_m
from testbed.benchmarks.diagnosis.robot_plain import MOTIONS, SOUND, Case, PlainEffects, plain_sizes
from testbed.effects import by_name


def test_every_kind_that_the_blind_test_hides_is_hidden_plainly_in_some_scene() -> None:
    table = plain_sizes()["effects"]
    assert set(table) == set(hidden_sizes()["named"])
    for name, row in table.items():
        assert set(row["motions"]) <= set(MOTIONS)
        by_name(name).complete(row["parameters"])


def test_cases_have_seeds_of_their_own_and_sound_machines_hide_nothing() -> None:
    cases = PlainEffects(first_seed=10, sounds=2).cases().values()
    assert len({case.seed for case in cases}) == len(cases)
    sound = [case for case in cases if case.effect == SOUND]
    assert len(sound) == 2 * len(MOTIONS) and not any(case.hidden() for case in sound)
    (only,) = PlainEffects(sounds=0, only=("drill.thrust",)).cases().values()
    assert only.motion == "drill"


def test_the_machine_from_before_is_the_same_without_the_effect() -> None:
    case = Case(10, "stand", "robot.payload")
    now, before = case.scenario(), case.scenario(before=True)
    assert now.undeclared and not before.undeclared
    assert now.machine == before.machine and now.seed != before.seed


def test_a_cushion_begins_at_the_same_share_of_any_stroke() -> None:
    shares = set()
    for seed in range(20):
        (hidden,) = Case(seed, "stand", "force.cushion").hidden()
        shares.add(round(hidden["parameters"]["start"] / strokes_m()[hidden["at"]], 9))
    assert shares == {plain_sizes()["effects"]["force.cushion"]["parameters"]["start"]}


@pytest.fixture
def answers() -> dict[str, Any]:
    """What three runs may say."""
    said = {"motion": "stand", "probability": 0.9, "rival": "x", "rival_evidence": 1.0}
    found = {"verdict": "effect", "evidence": 20.0}
    return {
        "a": {**said, **found, "seed": 1, "hidden": "k@p", "names": ["k@p"]},
        "b": {**said, **found, "seed": 2, "hidden": "k@p", "names": ["l@p"]},
        "c": {**said, "seed": 3, "hidden": "", "names": [], "verdict": "none", "evidence": None},
    }


def test_shares_are_those_of_the_runs_that_hide_something(answers: dict[str, Any]) -> None:
    benchmark = PlainEffects()
    found = benchmark.summarise(answers)
    assert found["named"]["share"] == 0.5 and found["place"]["share"] == 1.0
    assert found["misnamed"]["share"] == 0.5 and found["sound_left_alone"]["share"] == 1.0
    shares, runs = benchmark.tables(found)
    assert len(runs.rows) == 3 and shares.rows
