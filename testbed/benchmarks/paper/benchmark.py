"""The paper's experiments by the number of their figure, each one case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, cast

from testbed.benchmarks.harness import Answers, Benchmark
from testbed.benchmarks.paper.experiment import Experiment, described, evaluated
from testbed.benchmarks.paper.leg import of_set
from testbed.benchmarks.paper.page import page, table
from testbed.errors import InputError
from testbed.machine.provenance import DEFAULT, SET_NAMES, SetName
from testbed.report.page import Table

TABLES = {"II": "4", "III": "8", "IV": "12"}
"""The figure that each table belongs to."""


def chosen(names: Sequence[str]) -> list[str]:
    """Figures asked for by number or by table ('6', 'III'), in the paper's order, each once; all
    for none.

    Raises InputError for one that the paper's experiments do not have.
    """
    wanted = {TABLES.get(key.strip().upper(), key.strip().lstrip("0")) for key in names}
    for name in names:
        if TABLES.get(name.strip().upper(), name.strip().lstrip("0")) not in described():
            raise InputError(
                "no such figure",
                field="FIGURE",
                value=name,
                allowed=", ".join((*described(), *TABLES)),
            )
    return [figure for figure in described() if figure in wanted or not names]


def experiment(figure: str, machine: SetName = DEFAULT) -> Experiment:
    """Run the experiment of a figure on a set of the machine's numbers."""
    module = import_module(f"testbed.benchmarks.paper.figure_{int(figure):02d}")
    with of_set(machine):
        return evaluated(figure, module.experiment())


@dataclass(frozen=True)
class Paper(Benchmark[str]):
    """`figures` by number or table ('6', 'III'), all for none, on a machine. Raises InputError for
    what there is not.
    """

    name = "paper"
    noun = "figures"
    beside = ("estimators",)
    figures: tuple[str, ...] = ()
    machine: str = DEFAULT
    """A set of the machine's numbers."""

    def __post_init__(self) -> None:
        chosen(self.figures)
        if self.machine not in SET_NAMES:
            allowed = ", ".join(SET_NAMES)
            raise InputError("no such set", field="--machine", value=self.machine, allowed=allowed)

    def cases(self) -> Mapping[str, str]:
        """The figures in the paper's order."""
        return {figure: figure for figure in chosen(self.figures)}

    def work(self, case: str) -> Experiment:
        """Run a figure's experiment."""
        return experiment(case, cast(SetName, self.machine))

    def summarise(self, answers: Answers) -> list[Experiment]:
        """The experiments."""
        return [Experiment.read(answer) for answer in answers.values()]

    def published(self, result: Sequence[Experiment]) -> list[dict[str, Any]]:
        """The claims alone."""
        return [claim.tree() for experiment in result for claim in experiment.claims]

    def tables(self, result: Sequence[Experiment]) -> Sequence[Table]:
        """One table."""
        return [table(result)]

    def page(self, result: Sequence[Experiment]) -> str:
        """See page.page."""
        return page(result)
