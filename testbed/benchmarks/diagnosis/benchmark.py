"""The blind test of the diagnosis on random rigs of the reference leg."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from testbed.benchmarks.diagnosis.page import page, table
from testbed.benchmarks.diagnosis.scores import Trial, scores
from testbed.benchmarks.diagnosis.trials import trial
from testbed.benchmarks.harness import Answers, Benchmark
from testbed.report.page import Table

FIRST_SEED = 1000
"""Seeds below were looked at while thresholds were set; the blind test begins here."""


@dataclass(frozen=True)
class BlindTest(Benchmark[int]):
    """`rigs` rigs of consecutive seeds."""

    name = "evaluation"
    noun = "rigs"
    beside = ("reference_leg",)
    rigs: int = 200
    first_seed: int = FIRST_SEED

    def cases(self) -> Mapping[str, int]:
        """The seeds."""
        return {str(seed): seed for seed in range(self.first_seed, self.first_seed + self.rigs)}

    def work(self, case: int) -> Trial:
        """See trials.trial."""
        return trial(case)

    def without(self) -> tuple[str, ...]:
        """How answers are scored, and the other benchmarks of this folder."""
        names = ("scores.py", "*calibration.py", "robot_*.py", "measured_rigs.py")
        return tuple(f"benchmarks/diagnosis/{name}" for name in names)

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """See scores.scores."""
        return scores(list(answers.values()))

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """One table."""
        return [table(result)]

    def page(self, result: dict[str, Any]) -> str:
        """See page.page."""
        return page(result)
