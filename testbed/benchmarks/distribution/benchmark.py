"""The force-distributing controllers on identical held-out cases, against an oracle that knows the
truth.
"""

from __future__ import annotations

import csv
import inspect
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from testbed.benchmarks.distribution.run import ORACLE, Case, Outcome, draw_cases, run_case
from testbed.benchmarks.distribution.summary import (
    against_table,
    short,
    summarise,
    table,
    write_figure,
)
from testbed.benchmarks.harness import PACKAGE, Answers, Benchmark, code, digest
from testbed.control.distribution.controllers import CONTROLLERS, controller
from testbed.control.distribution.quadratic import Quadratic
from testbed.errors import InputError
from testbed.formats.files import write_text
from testbed.report.page import Table

Run = tuple[Case, str]
"""A case, and the controller it runs under."""


@dataclass(frozen=True)
class ForceDistribution(Benchmark[Run]):
    """`count` cases of each of `seeds` held-out sets under `controllers` (names or FILE.py:Class)
    and the oracle.

    Raises InputError for counts below one and for an unknown controller.
    """

    name = "distribution"
    noun = "runs"
    count: int = 1000
    seeds: int = 1
    controllers: tuple[str, ...] = tuple(CONTROLLERS)
    draw: str | None = "workshop"
    """Tolerances from which each case's machine is drawn."""

    def __post_init__(self) -> None:
        for field, value in (("--cases", self.count), ("--seeds", self.seeds)):
            if value < 1:
                raise InputError("must be at least 1", field=field, value=value)
        for name in self.controllers:
            controller(name)

    def cases(self) -> Mapping[str, Run]:
        """Every case under every controller."""
        drawn, names = draw_cases(self.count, self.seeds, self.draw), (*self.controllers, ORACLE)
        return {f"{case.key} {name}": (case, name) for case in drawn for name in names}

    def work(self, case: Run) -> Outcome:
        """One case under one controller."""
        return run_case(*case)

    def without(self) -> tuple[str, ...]:
        """No controller has a say in what another one's runs give."""
        classes = [made for made in CONTROLLERS.values() if inspect.isclass(made)]
        owned = {path for made in classes for path in own_files(made)}
        table_of_them = Path("control/distribution/controllers.py")
        return (str(table_of_them), *(str(path.relative_to(PACKAGE)) for path in sorted(owned)))

    def made_from(self, case: Run) -> str:
        """The case, and the controller's own files and weights."""
        return f"{case!r} {digest(*map(code, controller_files(case[1])))}"

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """See summary.summarise."""
        outcomes = {key: Outcome(**answer) for key, answer in answers.items()}
        cases = draw_cases(self.count, self.seeds, self.draw)
        names = (*self.controllers, ORACLE)
        return summarise(
            cases, [[outcomes[f"{case.key} {name}"] for name in names] for case in cases]
        )

    def published(self, result: dict[str, Any]) -> dict[str, Any]:
        """Without the single runs, which stand in distribution.csv."""
        return {key: value for key, value in result.items() if key not in ("drawn", "runs")}

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """All controllers; those beside the quadratic program against it."""
        compared = result["against_qp"]
        return [table(result), *([against_table(compared)] if compared else [])]

    def write_more(self, result: dict[str, Any], out: Path) -> None:
        """distribution.csv, a run a line, and distribution.png."""
        lines = [
            case | {key: short(value) for key, value in outcome.items()}
            for case, row in zip(result["drawn"], result["runs"], strict=True)
            for outcome in row
        ]
        text = io.StringIO()
        writer = csv.DictWriter(text, list(lines[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(lines)
        write_text(out / "distribution.csv", text.getvalue())
        write_figure(result, out)


def own_files(made: type) -> list[Path]:
    """The project's files that a class and its bases are written in."""
    return [
        Path(inspect.getfile(kind))
        for kind in made.__mro__
        if kind.__module__.startswith("testbed.")
    ]


def controller_files(name: str) -> list[Path]:
    """The files that one controller is made of: sources and weights."""
    files = own_files(Quadratic if name == ORACLE else type(controller(name)))
    if name.endswith(".npz") or ":" in name:
        files.append(Path(name if name.endswith(".npz") else name.rpartition(":")[0]))
    weights = [path.with_suffix(".npz") for path in files]
    return [*files, *(path for path in weights if path.is_file() and path not in files)]
