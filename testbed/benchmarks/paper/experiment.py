"""What an experiment of the paper comes to: claims with a stated criterion, plots and tables as
plain data.

What the paper says, how it is run here and every criterion stand in figures.yaml; a figure's module
gives what it measured, under the names that stand there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from testbed.formats.arrays import Array
from testbed.formats.yaml_files import read_mapping
from testbed.report.page import Table

Rows = Sequence[Sequence[str]]
FIGURES_YAML = Path(__file__).with_name("figures.yaml")


@dataclass(frozen=True)
class Claim:
    """One statement, the range [low, high] in which it counts as borne out, and what was
    measured.
    """

    figure: str
    claim: str
    low: float
    high: float
    measured: float
    unit: str = "1"

    @property
    def holds(self) -> bool:
        """Measured and inside the range; a number that is not finite holds nothing."""
        return math.isfinite(self.measured) and self.low <= self.measured <= self.high

    @property
    def expected(self) -> float | list[float]:
        """The bound where there is one, [low, high] where there are two."""
        if math.isinf(self.high):
            return self.low
        return self.high if math.isinf(self.low) else [self.low, self.high]

    @property
    def criterion(self) -> str:
        """The range in words."""
        if math.isinf(self.high):
            return f"at least {self.low:.4g}"
        return (
            f"at most {self.high:.4g}"
            if math.isinf(self.low)
            else f"{self.low:.4g} to {self.high:.4g}"
        )

    def tree(self) -> dict[str, Any]:
        """As JSON carries it; null for a number that could not be measured."""
        measured = self.measured if math.isfinite(self.measured) else None
        return {
            "figure": self.figure,
            "claim": self.claim,
            "expected": self.expected,
            "measured": measured,
            "unit": self.unit,
            "holds": self.holds,
        }


@dataclass(frozen=True)
class Line:
    """One curve: `style` is matplotlib's ('-', '--', '.', 'o'); `colour` a number of the
    palette.
    """

    x: Array
    y: Array
    label: str
    colour: int = 0
    style: str = "-"


@dataclass(frozen=True)
class Panel:
    """Axes with their curves."""

    title: str
    x_label: str
    y_label: str
    lines: Sequence[Line]


@dataclass(frozen=True)
class Experiment:
    """One figure: what the paper says, how it was run here, what came out."""

    figure: str
    title: str
    says: str
    setup: str
    claims: Sequence[Claim]
    panels: Sequence[Panel]
    tables: Sequence[Table] = ()
    notes: Sequence[str] = ()

    @classmethod
    def read(cls, tree: Mapping[str, Any]) -> Experiment:
        """An experiment from what JSON makes of it."""
        panels = [
            Panel(**{**panel, "lines": [Line(**line) for line in panel["lines"]]})
            for panel in tree["panels"]
        ]
        claims = [Claim(**claim) for claim in tree["claims"]]
        tables = [Table(*table) for table in tree["tables"]]
        return cls(**{**tree, "claims": claims, "panels": panels, "tables": tables})


@dataclass(frozen=True)
class Result:
    """What a figure's experiment gave, by the names of figures.yaml."""

    measured: Mapping[str, float]
    """By claim."""
    lines: Mapping[str, Sequence[Line]]
    """By panel."""
    rows: Mapping[str, Rows] = field(default_factory=dict)
    """By table."""
    numbers: Mapping[str, float] = field(default_factory=dict)
    """Those that stand in the figure's texts."""
    more_tables: Sequence[Table] = ()
    """Those whose heads the experiment gives, too."""


@cache
def described() -> Mapping[str, Any]:
    """figures.yaml, by figure."""
    return read_mapping(FIGURES_YAML)


def evaluated(figure: str, result: Result) -> Experiment:
    """A result in the words of figures.yaml, beside its criteria."""
    words = described()[figure]

    def text(template: str) -> str:
        return template.format(**result.numbers)

    claims = []
    for name, stated in words["claims"].items():
        low, high = stated.get(
            "between", (stated.get("at_least", -math.inf), stated.get("at_most", math.inf))
        )
        measured, unit = float(result.measured[name]), stated.get("unit", "1")
        claims.append(Claim(figure, text(stated["claim"]), low, high, measured, unit))
    return Experiment(
        figure,
        words["title"],
        words["says"],
        text(words["setup"]),
        claims,
        [
            Panel(panel["title"], panel["x"], panel["y"], result.lines[name])
            for name, panel in words["panels"].items()
        ],
        [
            *(
                Table(table["title"], table["heads"], result.rows[name])
                for name, table in words.get("tables", {}).items()
            ),
            *result.more_tables,
        ],
        [text(note) for note in words.get("notes", ())],
    )
