"""The paper's experiments by the number of their figure, run in order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module

from testbed.benchmarks.paper.experiment import Experiment
from testbed.errors import InputError

FIGURES = ("4", "5", "6", "7", "8", "9", "11", "12")
TABLES = {"II": "4", "III": "8", "IV": "12"}
"""The figure that each table belongs to."""


def chosen(names: Sequence[str]) -> list[str]:
    """Figures asked for by number or by table ('6', 'III'), in the paper's order, each once; all for none.

    Raises InputError for one that the paper's experiments do not have.
    """
    wanted = {TABLES.get(n.strip().upper(), n.strip().lstrip("0")) for n in names}
    for name in names:
        if TABLES.get(name.strip().upper(), name.strip().lstrip("0")) not in FIGURES:
            raise InputError(
                "no such figure", field="FIGURE", value=name, allowed=", ".join((*FIGURES, *TABLES))
            )
    return [f for f in FIGURES if f in wanted or not names]


def run_figures(
    figures: Sequence[str], progress: Callable[[int], None] | None = None
) -> list[Experiment]:
    """The experiments of `figures`; `progress` is told how many are done."""
    out = []
    for k, figure in enumerate(figures):
        module = import_module(f"testbed.benchmarks.paper.figure_{int(figure):02d}")
        out.append(module.experiment())
        if progress is not None:
            progress(k + 1)
    return out
