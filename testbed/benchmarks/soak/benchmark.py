"""`testbed soak`: the trials of every kind, and a table of how they ended."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from testbed.benchmarks.harness import Answers, Benchmark
from testbed.benchmarks.soak.trials import TRIALS, Trial, attempt
from testbed.report.tables import Table

RARE = {"killed run": 10, "killed sweep": 20}
"""Of these kinds only every so manieth trial is made: each takes many seconds."""


@dataclass(frozen=True)
class Soak(Benchmark[Trial]):
    """`trials` of each kind, the slow ones fewer; `seed` makes others."""

    name: ClassVar[str] = "soak"
    noun: ClassVar[str] = "trials"
    trials: int = 1000
    seed: int = 0

    def cases(self) -> Mapping[str, Trial]:
        """Every trial by its kind and number."""
        return {
            f"{kind} {self.seed + k}": Trial(kind, self.seed + k)
            for kind in TRIALS
            for k in range(max(self.trials // RARE.get(kind, 1), 1))
        }

    def work(self, case: Trial) -> dict[str, Any]:
        """See attempt."""
        return attempt(case)

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """Counts of the outcomes by kind, and every trial in which something was wrong."""
        kinds = []
        for kind in TRIALS:
            found = [a for name, a in answers.items() if name.rpartition(" ")[0] == kind]
            kinds.append(
                {
                    "kind": kind,
                    "trials": len(found),
                    "outcomes": dict(Counter(a["outcome"] for a in found)),
                    "wrong": sum(bool(a["wrong"]) for a in found),
                    "slowest_s": max((a["seconds"] for a in found), default=0.0),
                }
            )
        wrong = {name: a["wrong"] for name, a in answers.items() if a["wrong"]}
        return {"kinds": kinds, "wrong": wrong}

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """One line a kind; one a trial that went wrong."""
        rows = [
            [
                str(row["kind"]),
                str(row["trials"]),
                ", ".join(f"{n} {word}" for word, n in row["outcomes"].items()),
                str(row["wrong"]),
                f"{row['slowest_s']:.1f}",
            ]
            for row in result["kinds"]
        ]
        tables = [Table("Soak", ["kind", "trials", "outcomes", "wrong", "slowest [s]"], rows)]
        if result["wrong"]:
            lines = [[name, " ".join(text.split())] for name, text in result["wrong"].items()]
            tables.append(Table("What went wrong", ["trial", "what"], lines))
        return tables
