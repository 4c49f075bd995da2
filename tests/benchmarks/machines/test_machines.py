"""The benchmark of drawn machines: sums become marks, by task and belief; runs are kept as they
were.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from testbed.benchmarks.estimators.trials import Series
from testbed.benchmarks.machines.benchmark import DrawnMachines
from testbed.benchmarks.machines.runs import (
    ABLATIONS,
    MACHINES,
    TASKS,
    DrawnMachine,
    kept,
    read_kept,
    sums,
)
from testbed.errors import InputError
from testbed.robot.rope_bearings import SurveyedRopes


def run(rms: float, held: int) -> dict[str, float]:
    moving = {"moving_samples": 20, "moving_square": 20 * rms**2, "moving_held": held // 5}
    return {"samples": 100, "square": 100 * rms**2, "held": held, "moving_s": 0.02} | moving


def machine(seed: int, rms: float, held: int) -> dict[str, Any]:
    by: dict[str, Any] = {"perfect": run(50.0, 90), "commissioned": run(60.0, 90)}
    by |= {name: run(rms, held) for name in ("drawing board", *ABLATIONS)}
    by |= {
        name: {"samples": 100, "square": 100 * 150.0**2, "moving_s": 0.02}
        for name in ("friction", "modified_kbf")
    }
    zero = {"value": 10.0, "low": 0.0, "high": 20.0, "truth": float(seed)}
    numbers = {"axes.fl_vertical.zero_force_n": zero}
    return {"machine": seed, "numbers": numbers, "tasks": dict.fromkeys(TASKS, by)}


def test_errors_add_up_and_coverage_is_counted_by_machine() -> None:
    benchmark = DrawnMachines(machines=2, first_seed=15)
    answers = {"machine 15": machine(15, 100.0, 80), "machine 16": machine(30, 200.0, 60)}
    assert list(benchmark.cases()) == ["machine 15", "machine 16"]
    result = benchmark.summarise(answers)
    found = result["tasks"]["stand"]["drawing board"]
    assert found["rms_n"] == pytest.approx((0.5 * (100.0**2 + 200.0**2)) ** 0.5)
    assert found["worst_rms_n"] == pytest.approx(200.0)
    assert found["times_perfect"] == pytest.approx(found["rms_n"] / 50.0)
    assert found["covered"] == pytest.approx(0.7)
    assert found["covered_interval95"][0] == pytest.approx(0.7 - 1.96 * 0.1, abs=1e-3)
    assert found["covered_moving"] == pytest.approx(28 / 40)
    assert found["moving_s"] == pytest.approx(0.04) and found["machines_moving"] == 2
    assert found["worse_than_published"] == 1
    zeros = result["commissioning"]["sensor zeros"]
    assert zeros["held"] == 0.5 and zeros["rms_half_width"] == 10.0
    assert [len(table.rows) for table in benchmark.tables(result)] == [15, len(ABLATIONS) + 3, 1]


def test_a_run_that_was_kept_scores_as_it_did(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    columns = {"t": np.arange(5) * 1e-3, "pressure_a_fl_vertical": rng.normal(5e6, 1e5, 5)}
    series = Series(
        columns, {"foot_load_fl": rng.normal(1e4, 1e3, 5)}, SurveyedRopes.along(30.0 * np.eye(2, 3))
    )
    kept(series, tmp_path / "stand 1.npz")
    again = read_kept(tmp_path / "stand 1.npz")
    np.testing.assert_array_equal(again.data["t"], columns["t"])
    np.testing.assert_allclose(again.truth["foot_load_fl"], series.truth["foot_load_fl"], rtol=1e-6)
    np.testing.assert_array_equal(again.ropes.directions, np.eye(2, 3))
    np.testing.assert_array_equal(again.ropes.distances_m, [30.0, 30.0])


def test_moving_samples_are_counted_apart() -> None:
    error, sd = np.array([[10.0, -30.0, 5.0]]), np.array([[10.0, 10.0, 1.0]])
    out = sums(error, sd, np.array([[False, True, True]]))
    assert out["samples"] == 3 and out["held"] == 1 and out["square"] == 1025.0
    assert out["moving_samples"] == 2 and out["moving_held"] == 0


def test_no_machine_at_all_is_refused() -> None:
    with pytest.raises(InputError, match="--machines"):
        DrawnMachines(machines=0)


def test_machines_of_another_plan_are_cases_of_their_own_or_refused() -> None:
    cases = {name: set(DrawnMachines(machine=name).cases()) for name in MACHINES}
    assert sum(map(len, cases.values())) == len(set.union(*cases.values()))
    made_from = {DrawnMachines(machine=name).made_from(2000) for name in MACHINES}
    assert len(made_from) == len(MACHINES)
    with pytest.raises(InputError, match="roboclimber, climber_8t, quarter_model"):
        DrawnMachines(machine="climber_9t")


@pytest.mark.parametrize("name", MACHINES)
def test_every_task_is_one_of_its_machine(name: str) -> None:
    folders = {
        task: DrawnMachine(1, "workshop", name).task(task).machine.folder
        for task in MACHINES[name].tasks
    }
    names = {folder and Path(folder).name for folder in folders.values()}
    assert names == {None if name == "roboclimber" else name}


def test_seals_begin_stuck_by_the_share_that_is_asked_for() -> None:
    stuck = {
        share: DrawnMachine(1, "workshop", stuck_seals=share).task("stand").hydraulics.stuck_seals
        for share in (0.0, 0.25, 1.0)
    }
    assert all(share == begun for share, begun in stuck.items())
    names = {DrawnMachines(stuck_seals=share).made_from(2000) for share in stuck}
    files = {DrawnMachine(1, "workshop", stuck_seals=share).name for share in stuck}
    assert len(names) == len(files) == len(stuck)
