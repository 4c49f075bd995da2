"""The whole-body estimate on drawn machines: by what the robot believes, task by task, and what
each idea of it earns.

Each machine commissions itself, then does every task once; every belief and every ablation sees the
same recordings.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from testbed.benchmarks.harness import Answers, Benchmark, rms
from testbed.benchmarks.machines.best_stand import worse_than_published
from testbed.benchmarks.machines.runs import (
    ABLATIONS,
    BOARD,
    COMMISSIONED,
    HORIZON,
    MACHINES,
    PERFECT,
    PUBLISHED,
    ROBOCLIMBER,
    DrawnMachine,
    commissioned,
    recorder,
    scores,
)
from testbed.errors import InputError
from testbed.formats.files import read_json, write_json
from testbed.report.page import Table

Z95 = 1.959964
KINDS = {
    "sensor zeros": "zero_force",
    "Coulomb friction": "coulomb",
    "break-away friction": "static",
    "viscous friction": "viscous",
    "friction by side load": "side_load",
    "friction by pressure": "pressure_coefficient",
    "weight": "total_mass",
    "centre of mass": "centre_of_mass",
    "inertial unit": "robot.attitude@",
    "rope directions": "rope.direction@",
    "load pins": "rope.tension_gain@",
    "heights of the ropes": "rope.attachment@",
}
"""Kind of number that a commissioning finds -> what its names hold."""


@dataclass(frozen=True)
class DrawnMachines(Benchmark[int]):
    """`machines` machines drawn from the tolerances `draw`, the first with the seed `first_seed`.

    `commissions`: each commissions itself first; `recordings`: a folder in which runs and models
    are kept, and taken from; `ideas`: on so many machines the estimate runs without each idea too;
    `machine`: which of the shipped ones they are drawn from; `stuck_seals`: how far from loose
    their seals are when a run begins, as `DrawnMachine` has it.
    """

    name = "machines"
    noun = "machines"
    beside = ("estimators",)
    machines: int = 8
    first_seed: int = 2000
    draw: str = "workshop"
    commissions: bool = True
    recordings: Path | None = None
    ideas: int = 8
    machine: str = ROBOCLIMBER
    stuck_seals: float = 1.0

    def __post_init__(self) -> None:
        if self.machine not in MACHINES:
            allowed = ", ".join(MACHINES)
            raise InputError(
                "is none of those shipped", field="--machine", value=self.machine, allowed=allowed
            )
        if self.machines < 1:
            raise InputError("must be at least 1", field="--machines", value=self.machines)

    def cases(self) -> Mapping[str, int]:
        """Every machine by its seed."""
        seeds = range(self.first_seed, self.first_seed + self.machines)
        return {f"machine {self._drawn(seed).name}": seed for seed in seeds}

    def made_from(self, case: int) -> str:
        """The machine, its tolerances, and what is tried on it."""
        return f"{self._drawn(case)!r} {self.commissions} {self._tries_ideas(case)}"

    def _drawn(self, seed: int) -> DrawnMachine:
        return DrawnMachine(seed, self.draw, self.machine, self.stuck_seals)

    @property
    def _tasks(self) -> Sequence[str]:
        return tuple(MACHINES[self.machine].tasks)

    def _tries_ideas(self, case: int) -> bool:
        return case < self.first_seed + self.ideas

    def work(self, case: int) -> dict[str, Any]:
        """What its commissioning found beside the truth, and `sums` by task and belief."""
        drawn = self._drawn(case)
        with TemporaryDirectory() as folder:
            model: Path | None = None
            found: dict[str, Any] = {}
            if self.commissions:
                model, found = self._commissioned(drawn, self.recordings or Path(folder))
            tasks = {}
            for task in self._tasks:
                record = recorder(self.recordings, f"{task} {drawn.name}")
                scenario = drawn.task(task)
                tasks[task] = scores(scenario, model, self._tries_ideas(case), record)
        return {"machine": case, "numbers": found, "tasks": tasks}

    def _commissioned(self, drawn: DrawnMachine, folder: Path) -> tuple[Path, dict[str, Any]]:
        """Its model file and what is in it, from the folder where they are there."""
        model, numbers = folder / f"model {drawn.name}.yaml", folder / f"numbers {drawn.name}.json"
        if not numbers.is_file():
            folder.mkdir(parents=True, exist_ok=True)
            found = commissioned(drawn, model, self.recordings)
            write_json(numbers, found)
        return model, read_json(numbers)

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """Error and coverage by task and belief, what each idea earns, and how often commissioning
        was right.
        """
        every = list(answers.values())
        tried = [answer for answer in every if next(iter(ABLATIONS)) in answer["tasks"]["stand"]]
        return {
            "machine": self.machine,
            "machines": self.machines,
            "first_seed": self.first_seed,
            "draw": self.draw,
            "stuck_seals": self.stuck_seals,
            "best_stand_worse_than_published": self._best_worse_than_published(),
            "tasks": {
                task: _by_belief([answer["tasks"][task] for answer in every])
                for task in self._tasks
            },
            "machines_ideas": len(tried),
            "ideas": {
                task: _by_belief([answer["tasks"][task] for answer in tried])
                for task in (self._tasks if tried else ())
            },
            "commissioning": _held(answer["numbers"] for answer in every),
        }

    def _best_worse_than_published(self) -> float | None:
        """Share of stands in which even the best estimate errs more than (7), where seals are stuck
        anywhere; else None.
        """
        if self.stuck_seals < 1.0:
            return None
        return worse_than_published(self._drawn(self.first_seed).task("stand"))

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """Beliefs by task, ideas by task, numbers by kind."""
        tables = [_beliefs(result)]
        tables += [_ideas(result)] if result["ideas"] else []
        tables += [_numbers(result)] if result["commissioning"] else []
        return tables


def _by_belief(runs: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """`marks` by belief or method, beside how often it is worse than the paper's (7)."""
    out = {}
    for name in set.intersection(*map(set, runs)):
        out[name] = marks([run[name] for run in runs])
        out[name]["worse_than_published"] = sum(
            run[name]["square"] > run[PUBLISHED[0]]["square"] for run in runs
        )
        out[name]["times_perfect"] = (
            out[name]["rms_n"] / marks([run[PERFECT] for run in runs])["rms_n"]
        )
    return out


def marks(runs: Sequence[Mapping[str, float]]) -> dict[str, Any]:
    """RMS error over all machines and of the worst one, N, and the intervals' coverage: all,
    moving, at rest.

    The coverage's own interval is that of a mean over machines, which err each in its own way.
    """
    total = {key: sum(run[key] for run in runs) for key in runs[0]}
    out: dict[str, Any] = {
        "rms_n": math.sqrt(total["square"] / total["samples"]),
        "worst_rms_n": max(math.sqrt(run["square"] / run["samples"]) for run in runs),
    }
    if "held" not in total:
        return out
    moving = total["moving_samples"]
    resting = total["samples"] - moving
    by_machine = [run["held"] / run["samples"] for run in runs]
    half = Z95 * float(np.std(by_machine)) / math.sqrt(max(len(runs) - 1, 1))
    mean = float(np.mean(by_machine))
    moved = [run for run in runs if run["moving_samples"]]
    return out | {
        "moving_s": total["moving_s"],
        "machines_moving": len(moved),
        "covered": mean,
        "covered_interval95": [max(mean - half, 0.0), min(mean + half, 1.0)],
        "covered_moving": total["moving_held"] / moving if moving else None,
        "covered_at_rest": (total["held"] - total["moving_held"]) / resting if resting else None,
    }


def _held(machines: Iterable[Mapping[str, Mapping[str, float]]]) -> dict[str, Any]:
    """By kind of number: how many were found, how many intervals held the truth, error and half
    width, RMS.
    """
    machines, out = list(machines), {}
    for kind, part in KINDS.items():
        numbers = [number for found in machines for name, number in found.items() if part in name]
        if not numbers:
            continue
        shares = [
            float(np.mean([number["low"] <= number["truth"] <= number["high"] for number in mine]))
            for found in machines
            if (mine := [number for name, number in found.items() if part in name])
        ]
        out[kind] = {
            "numbers": len(numbers),
            "machines": len(shares),
            "held": sum(number["low"] <= number["truth"] <= number["high"] for number in numbers)
            / len(numbers),
            "held_interval95": Z95 * float(np.std(shares)) / math.sqrt(max(len(shares) - 1, 1)),
            "rms_error": rms([number["value"] - number["truth"] for number in numbers]),
            "rms_half_width": rms([0.5 * (number["high"] - number["low"]) for number in numbers]),
            "rms_truth_about_mean": float(np.std([number["truth"] for number in numbers])),
        }
    return out


def _newtons(value: float) -> str:
    """Whole ones; of a light machine three figures."""
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"


def _beliefs(result: Mapping[str, Any]) -> Table:
    names = [
        belief
        for belief in (PERFECT, COMMISSIONED, HORIZON, BOARD)
        if belief in result["tasks"]["stand"]
    ]
    rows = []
    for task, by in result["tasks"].items():
        for name in names:
            row = by[name]
            low, high = row["covered_interval95"]
            moving = row["covered_moving"]
            rows.append(
                [
                    task,
                    name,
                    _newtons(row["rms_n"]),
                    f"{row['times_perfect']:.2f}",
                    _newtons(row["worst_rms_n"]),
                    f"{100 * row['covered']:.0f} ({100 * low:.0f} to {100 * high:.0f})",
                    f"{100 * row['covered_at_rest']:.0f}",
                    "–" if moving is None else f"{100 * moving:.0f} ({row['moving_s']:.0f} s)",
                    str(row["worse_than_published"]),
                    _newtons(by[PUBLISHED[0]]["rms_n"]),
                ]
            )
    header = ["task", "belief", "RMS error [N]", "times perfect", "worst machine [N]"]
    header += [
        "90 % interval holds [%]",
        "at rest",
        "moving (feet' time)",
        "machines worse than (7)",
        "(7) [N]",
    ]
    seeds = f"seeds {result['first_seed']} on"
    machines = f"{result['machines']} machines drawn from {result['machine']}"
    title = f"Whole-body estimate, {machines}, {seeds}"
    by_chance = result.get("best_stand_worse_than_published")
    if by_chance is not None:
        title += f" (the best that the drawing allows is worse than (7) in {100 * by_chance:.1f} % of stands)"
    return Table(title, header, rows)


def _ideas(result: Mapping[str, Any]) -> Table:
    tasks = result["ideas"]
    rows = [
        [
            name,
            *(
                f"{by[name]['rms_n']:.0f} ({100 * by[name]['covered']:.0f} %)"
                for by in tasks.values()
            ),
        ]
        for name in (BOARD, *ABLATIONS)
    ]
    rows += [
        [f"paper: {published}", *(f"{by[published]['rms_n']:.0f}" for by in tasks.values())]
        for published in PUBLISHED
    ]
    title = f"What each idea earns, {result['machines_ideas']} machines, not commissioned"
    return Table(f"{title}: RMS error [N] (coverage)", ["", *tasks], rows)


def _numbers(result: Mapping[str, Any]) -> Table:
    rows = [
        [
            kind,
            str(held["numbers"]),
            f"{100 * held['held']:.0f} ± {100 * held['held_interval95']:.0f}",
            f"{held['rms_error']:.3g}",
            f"{held['rms_half_width']:.3g}",
            f"{held['rms_truth_about_mean']:.3g}",
        ]
        for kind, held in result["commissioning"].items()
    ]
    header = [
        "kind",
        "numbers",
        "90 % interval holds [%]",
        "RMS error",
        "half width",
        "spread drawn",
    ]
    return Table("What commissioning finds, SI", header, rows)
