"""The whole-body estimate on drawn machines of which something is believed that is far from true: a
weight on board that nobody declared, ropes surveyed in another direction, a pressure sensor that
reads too little.

Nothing of it is within the tolerances that the robot goes by. How much the estimate errs then, and
whether its intervals say so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from testbed.benchmarks.harness import Answers, Benchmark
from testbed.benchmarks.machines.benchmark import marks
from testbed.benchmarks.machines.runs import BOARD, PUBLISHED, DrawnMachine, recorder, scores
from testbed.errors import InputError
from testbed.report.page import Table
from testbed.scenario.scenario import Scenario

TASKS = ("stand", "raise", "drill", "crawl")
NOTHING = "as drawn"
PAYLOAD = "{{effect: robot.payload, at: body, parameters: {{mass: {}, x: 0.0, y: 0.0, z: 0.4}}}}"
STEEPER = "{{effect: rope.direction, at: rope_{}, parameters: {{azimuth: 0.0, elevation: 0.052}}}}"
LIAR = "{effect: sensor.gain_a, at: fr_vertical, parameters: {gain_error: -0.1}}"
WRONG: dict[str, tuple[str, ...]] = {
    NOTHING: (),
    "300 kg on board": (PAYLOAD.format(300),),
    "600 kg on board": (PAYLOAD.format(600),),
    "ropes 3 degrees steeper": (STEEPER.format("left"), STEEPER.format("right")),
    "a sensor reads 10 % less": (LIAR,),
}
"""What is wrong -> what the world has that the robot does not know."""


@dataclass(frozen=True)
class Case:
    """One task of a drawn machine, with something wrong."""

    seed: int
    task: str
    wrong: str

    @property
    def name(self) -> str:
        """Among files and cases."""
        return f"{self.task}, {self.wrong}, {self.seed}"

    def scenario(self) -> Scenario:
        """Not commissioned; what is wrong was always so."""
        hidden = f"undeclared=[{', '.join(WRONG[self.wrong])}]"
        return DrawnMachine(self.seed, "workshop").task(self.task, hidden)


@dataclass(frozen=True)
class WrongBeliefs(Benchmark[Case]):
    """Every task of `machines` drawn machines from the seed `first_seed` on, with each of WRONG;
    `recordings`: a folder in which runs are kept, and taken from.
    """

    name = "wrong_beliefs"
    noun = "runs"
    beside = ("estimators",)
    machines: int = 4
    first_seed: int = 2000
    recordings: Path | None = None

    def __post_init__(self) -> None:
        if self.machines < 1:
            raise InputError("must be at least 1", field="--machines", value=self.machines)

    def cases(self) -> Mapping[str, Case]:
        """Machine by machine."""
        seeds = range(self.first_seed, self.first_seed + self.machines)
        every = [Case(seed, task, wrong) for seed in seeds for task in TASKS for wrong in WRONG]
        return {case.name: case for case in every}

    def made_from(self, case: Case) -> str:
        """The case."""
        return repr(case)

    def work(self, case: Case) -> dict[str, Any]:
        """Sums of the estimate and of (7)."""
        record = recorder(self.recordings, case.name)
        found = scores(case.scenario(), None, False, record)
        kept = {name: found[name] for name in (BOARD, PUBLISHED[0])}
        return {"task": case.task, "wrong": case.wrong, "sums": kept}

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """Error and coverage by task and by what is wrong."""
        every = list(answers.values())
        return {
            "machines": self.machines,
            "first_seed": self.first_seed,
            "tasks": {
                task: {wrong: _marks(every, task, wrong) for wrong in WRONG} for task in TASKS
            },
        }

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """Error, in brackets (7), and what intervals hold, by task."""
        rows = [[wrong, *(_cell(by[wrong]) for by in result["tasks"].values())] for wrong in WRONG]
        title = f"{result['machines']} drawn machines, seeds {result['first_seed']} on"
        what = "RMS error [N], (7) in brackets; what 90 % intervals hold"
        return [Table(f"{title}, not commissioned: {what}", ["wrong", *result["tasks"]], rows)]


def _marks(every: Sequence[Mapping[str, Any]], task: str, wrong: str) -> dict[str, Any]:
    mine = [case["sums"] for case in every if (case["task"], case["wrong"]) == (task, wrong)]
    own = marks([sums[BOARD] for sums in mine])
    return own | {"published_rms_n": marks([sums[PUBLISHED[0]] for sums in mine])["rms_n"]}


def _cell(mark: Mapping[str, Any]) -> str:
    held = f"{100 * mark['covered']:.0f} %"
    return f"{mark['rms_n']:.0f} ({mark['published_rms_n']:.0f}); {held}"
