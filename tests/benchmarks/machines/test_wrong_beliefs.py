"""The benchmark of wrong beliefs: what is wrong is in the world alone, and sums become marks."""

from __future__ import annotations

from typing import Any

import pytest

from testbed.benchmarks.machines.runs import DrawnMachine, beliefs
from testbed.benchmarks.machines.wrong_beliefs import NOTHING, TASKS, WRONG, Case, WrongBeliefs
from testbed.errors import InputError
from testbed.scenario.machines import machines_of


def sums(rms: float, held: int) -> dict[str, Any]:
    moving = {"moving_samples": 0, "moving_square": 0.0, "moving_held": 0, "moving_s": 0.0}
    own = {"samples": 100, "square": 100 * rms**2, "held": held} | moving
    return {"drawing board": own, "friction": own | {"square": 100 * 400.0**2}}


@pytest.mark.parametrize("wrong", WRONG)
def test_what_is_wrong_reaches_the_world_and_no_belief(wrong: str) -> None:
    case = Case(3, "stand", wrong)
    hidden = [entry.effect for entry in case.scenario().undeclared]
    assert len(hidden) == len(WRONG[wrong])
    sound = DrawnMachine(3, "workshop").task("stand")
    assert machines_of(case.scenario()).belief == machines_of(sound).belief
    mine, theirs = (
        beliefs(scenario, None)["drawing board"] for scenario in (case.scenario(), sound)
    )
    assert mine.sure == theirs.sure and mine.machine == theirs.machine


def test_every_machine_does_every_task_with_everything_wrong() -> None:
    cases = WrongBeliefs(3, 100).cases()
    assert len(cases) == 3 * len(TASKS) * len(WRONG)
    assert {case.seed for case in cases.values()} == {100, 101, 102}


def test_marks_are_of_a_task_and_of_what_was_wrong() -> None:
    answers = {
        name: {
            "task": case.task,
            "wrong": case.wrong,
            "sums": sums(300.0 if case.wrong == NOTHING else 500.0, 90 if case.seed else 70),
        }
        for name, case in WrongBeliefs(2, 0).cases().items()
    }
    result = WrongBeliefs(2, 0).summarise(answers)
    sound, wrong = (result["tasks"]["crawl"][name] for name in (NOTHING, "600 kg on board"))
    assert sound["rms_n"] == pytest.approx(300.0) and wrong["rms_n"] == pytest.approx(500.0)
    assert wrong["published_rms_n"] == pytest.approx(400.0)
    assert wrong["covered"] == pytest.approx(0.8)
    (table,) = WrongBeliefs(2, 0).tables(result)
    assert table.rows[0][1:] == ["300 (400); 80 %"] * len(TASKS)


def test_no_machine_is_no_benchmark() -> None:
    with pytest.raises(InputError, match="at least 1"):
        WrongBeliefs(0)
