"""The benchmark of drawn machines: sums become marks, by task and belief."""

from __future__ import annotations

from typing import Any

import pytest

from testbed.benchmarks.machines.benchmark import TASKS, DrawnMachines
from testbed.errors import InputError


def answer(task: str, machine: int | None, square: float, held: int) -> dict[str, Any]:
    run = {"task": task, "machine": machine, "verdict": "stood"}
    return run | {"samples": 100, "square": square, "held": held}


def test_errors_add_up_over_machines_and_the_worst_is_named() -> None:
    benchmark = DrawnMachines(machines=2)
    answers = {}
    for task in TASKS:
        answers[f"{task} perfect"] = answer(task, None, 100.0 * 50.0**2, 95)
        answers[f"{task} 1"] = answer(task, 1, 100.0 * 100.0**2, 80)
        answers[f"{task} 2"] = answer(task, 2, 100.0 * 200.0**2, 60)
    assert set(answers) == set(benchmark.cases())
    result = benchmark.summarise(answers)
    found = result["tasks"]["stand"]
    assert found["perfect"] == {"rms_n": 50.0, "covered": 0.95}
    assert found["drawing board"]["rms_n"] == pytest.approx((0.5 * (100.0**2 + 200.0**2)) ** 0.5)
    assert found["drawing board"]["covered"] == pytest.approx(0.7)
    assert found["worst"] == {"rms_n": 200.0, "covered": 0.6, "machine": 2}
    assert len(benchmark.tables(result)[0].rows) == len(TASKS)


def test_no_machine_at_all_is_refused() -> None:
    with pytest.raises(InputError, match="--machines"):
        DrawnMachines(machines=0)
