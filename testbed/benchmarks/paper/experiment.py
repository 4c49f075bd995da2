"""What an experiment of the paper comes to: claims with a stated criterion, plots and tables as
plain data.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.report.tables import Table

Array = NDArray[np.float64]


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
    unit: str

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


def at_least(figure: str, claim: str, low: float, measured: float, unit: str) -> Claim:
    """A claim that holds from `low` on."""
    return Claim(figure, claim, low, math.inf, float(measured), unit)


def at_most(figure: str, claim: str, high: float, measured: float, unit: str) -> Claim:
    """A claim that holds up to `high`."""
    return Claim(figure, claim, -math.inf, high, float(measured), unit)


def between(figure: str, claim: str, low: float, high: float, measured: float, unit: str) -> Claim:
    """A claim that holds from `low` to `high`."""
    return Claim(figure, claim, low, high, float(measured), unit)


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
