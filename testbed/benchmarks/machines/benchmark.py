"""The own estimate on drawn machines beside the perfect belief: error and coverage of its interval, task by task."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.harness import Answers, Benchmark
from testbed.errors import InputError
from testbed.machine.names import LEGS
from testbed.report.tables import Table
from testbed.scenario.scenario import load_scenario

TASKS: dict[str, tuple[str, tuple[str, ...]]] = {
    "stand": ("stand_slope_45", ("duration_s=20",)),
    "raise": (
        "stand_slope_45",
        (
            "duration_s=18",
            "task={kind: raise, start_s: 2, to_m: 0.35, step_m: 0.03, every_s: 4, speed_m_s: 0.02}",
        ),
    ),
    "drill": ("drill_slope_45", ("duration_s=20",)),
    "crawl": ("crawl_slope_45", ("duration_s=26",)),
}
"""Task -> shipped scenario and changes."""
BELIEFS = ("perfect", "drawing board")
LEFT_OUT_S, Z90 = 1.0, 1.645
"""The first second, in which everything starts from nothing, is not scored; a normal's 90 % interval."""


@dataclass(frozen=True)
class Case:
    """One run: a task on the drawing-board machine (None) or on a drawn one."""

    task: str
    machine: int | None
    draw: str


@dataclass(frozen=True)
class DrawnMachines(Benchmark[Case]):
    """`machines` machines drawn from the tolerances `draw`, the first with the seed `first_seed`."""

    name = "machines"
    noun = "runs"
    machines: int = 8
    first_seed: int = 1
    draw: str = "workshop"

    def __post_init__(self) -> None:
        if self.machines < 1:
            raise InputError("must be at least 1", field="--machines", value=self.machines)

    def cases(self) -> Mapping[str, Case]:
        """Every task on the machine that is as drawn up, then on each that was drawn."""
        seeds = range(self.first_seed, self.first_seed + self.machines)
        return {
            f"{task} {'perfect' if seed is None else seed}": Case(task, seed, self.draw)
            for seed in (None, *seeds)
            for task in TASKS
        }

    def work(self, case: Case) -> dict[str, Any]:
        """Squared error, samples and those that the interval holds, over all feet."""
        scenario, changes = TASKS[case.task]
        drawn = () if case.machine is None else draw_changes(case.draw, case.machine)
        return {"task": case.task, "machine": case.machine} | own_error(
            scenario, (*changes, *drawn)
        )

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """RMS error (N) and coverage by task and belief, and the worst machine of each."""
        tasks = {task: _by_belief(list(answers.values()), task) for task in TASKS}
        runs = [
            _marks(a) | {k: a[k] for k in ("task", "machine", "verdict")} for a in answers.values()
        ]
        return {"machines": self.machines, "draw": self.draw, "tasks": tasks, "runs": runs}

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """One row a task."""
        header = ["task", "perfect belief", "drawn machines", "worst machine", "times"]
        rows = []
        for task, by in result["tasks"].items():
            perfect, drawn = by["perfect"], by["drawing board"]
            rows.append(
                [
                    task,
                    _words(perfect),
                    _words(drawn),
                    _words(by["worst"]),
                    f"{drawn['rms_n'] / perfect['rms_n']:.1f}",
                ]
            )
        title = f"Own estimate: RMS error (coverage of its 90 % interval), {result['machines']} drawn machines"
        return [Table(title, header, rows)]


def draw_changes(draw: str, seed: int) -> tuple[str, str]:
    """Overrides that put a scenario onto a drawn machine."""
    return f"machine.draw={draw}", f"machine.seed={seed}"


def own_error(name: str, changes: Sequence[str], model: Path | None = None) -> dict[str, Any]:
    """Sums of the own estimate's error over a run, whose estimators believe a model file."""
    from testbed.world.simulation import Simulation

    world = Simulation(load_scenario(name, tuple(changes)), model)
    try:
        data_at, truth_at = world.data_columns.index, world.truth_columns.index
        load = [data_at(f"estimate_own_{leg}") for leg in LEGS]
        spread = [data_at(f"own_sd_{leg}") for leg in LEGS]
        true = [truth_at(f"foot_load_{leg}") for leg in LEGS]
        count, held, square = 0, 0, 0.0
        while not world.finished:
            data, truth = world.run_block(1000)
            late = truth[:, 0] > LEFT_OUT_S
            error = data[late][:, load] - truth[late][:, true]
            count += error.size
            held += int((np.abs(error) <= Z90 * data[late][:, spread]).sum())
            square += float((error**2).sum())
        return {"samples": count, "held": held, "square": square, "verdict": str(world.verdict)}
    finally:
        world.close()


def _by_belief(answers: Sequence[Mapping[str, Any]], task: str) -> dict[str, Any]:
    mine = [a for a in answers if a["task"] == task]
    perfect = [a for a in mine if a["machine"] is None]
    drawn = [a for a in mine if a["machine"] is not None]
    worst = max(drawn, key=lambda a: a["square"] / a["samples"])
    return {
        "perfect": _marks(*perfect),
        "drawing board": _marks(*drawn),
        "worst": _marks(worst) | {"machine": worst["machine"]},
    }


def _marks(*answers: Mapping[str, Any]) -> dict[str, float]:
    samples = sum(a["samples"] for a in answers)
    return {
        "rms_n": math.sqrt(sum(a["square"] for a in answers) / samples),
        "covered": sum(a["held"] for a in answers) / samples,
    }


def _words(marks: Mapping[str, float]) -> str:
    return f"{marks['rms_n']:.0f} N ({100.0 * marks['covered']:.0f} %)"
