"""What each figure fixes of the inferred circuit, and what it leaves open: every number at both
ends of its range.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from testbed.benchmarks.harness import Answers, Benchmark
from testbed.benchmarks.paper.search import RANGES, bench, decay, whole
from testbed.machine.build import build_machine
from testbed.report.page import Table

FIGURES = ("4", "5", "6", "9")
INFERRED = "as inferred"
LEAST_DECAY = 0.7
"""Largest error of figure 5's sum at the end of a hold over that at its start."""
Case = tuple[str, float]


@dataclass(frozen=True)
class Sensitivity(Benchmark[Case]):
    """Figures 4, 5, 6 and 9 on the default machine, and with one number at an end of its range."""

    name = "paper_sensitivity"
    noun = "circuits"
    beside = ("estimators",)

    def cases(self) -> Mapping[str, Case]:
        """The default machine, then each number's ends that are not its own value."""
        machine = build_machine()
        ends = [(path, end) for path, ends in RANGES.items() for end in ends]
        changed = [(path, end) for path, end in ends if end != machine.quantity(path).value]
        return {INFERRED: ("", 0.0)} | {f"{path} = {end:.3g}": (path, end) for path, end in changed}

    def work(self, case: Case) -> dict[str, Any]:
        """What the four figures measure on this circuit, and which of them hold."""
        path, value = case
        circuit = whole({path: value}) if path else {}
        found = bench(circuit)
        change_n, ratio = decay(circuit, found)
        held = (found.holds[0], change_n < 0.0 and ratio <= LEAST_DECAY, *found.holds[1:])
        return {
            "number": path,
            "value": value,
            "a": found.a,
            "b_n": found.b_n,
            "r2": found.r2,
            "decay_n": change_n,
            "decay_ratio": ratio,
            "peak_n": found.peak_n,
            "slips": [found.slips_5, found.slips_10],
            "held": [figure for figure, yes in zip(FIGURES, held, strict=True) if yes],
        }

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """The circuits, and by number: the ranges' ends at which a figure fails."""
        fixed: dict[str, dict[str, list[float]]] = {path: {} for path in RANGES}
        for row in answers.values():
            for figure in FIGURES if row["number"] else ():
                if figure not in row["held"]:
                    fixed[row["number"]].setdefault(figure, []).append(row["value"])
        return {"circuits": answers, "fixed_by": fixed}

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """What is fixed by which figure, then every circuit."""
        return [_fixed(result["fixed_by"]), _circuits(result["circuits"])]


def _fixed(fixed: Mapping[str, Mapping[str, Sequence[float]]]) -> Table:
    machine = build_machine()
    rows = []
    for path, (low, high) in RANGES.items():
        failing = fixed[path]
        marks = [
            "fails at " + ", ".join(f"{end:.3g}" for end in failing.get(figure, ()))
            for figure in FIGURES
        ]
        rows.append(
            [
                path,
                f"{machine.quantity(path).value:.3g}",
                f"{low:.3g} to {high:.3g}",
                *(
                    mark if figure in failing else ""
                    for mark, figure in zip(marks, FIGURES, strict=True)
                ),
                "" if failing else "left open",
            ]
        )
    heads = ["number", "inferred", "range", *(f"figure {figure}" for figure in FIGURES), ""]
    return Table("What fixes the numbers of the circuit", heads, rows)


def _circuits(answers: Mapping[str, Mapping[str, Any]]) -> Table:
    rows = [
        [
            name,
            f"{row['a']:.3f}",
            f"{row['b_n']:+.0f}",
            f"{row['r2']:.4f}",
            f"{row['decay_n']:+.0f}",
            f"{row['decay_ratio']:.2f}",
            f"{row['peak_n']:.0f}",
            "{}, {}".format(*row["slips"]),
            " ".join(row["held"]) or "none",
        ]
        for name, row in answers.items()
    ]
    heads = ["circuit", "4: a", "4: b [N]", "4: R2", "5: change [N]", "5: error end / start"]
    heads += ["6: peak [N]", "9: slips at 5, 10 mm/s", "figures held"]
    return Table("One number at an end of its range", heads, rows)
