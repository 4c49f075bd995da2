"""What a robot's commissioning finds: numbers of the machine with their intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from testbed.formats.arrays import Array
from testbed.formats.intervals import interval90

SHOWN = 0.9
"""A number counts as shown where its interval is narrower than this share of what was known
before.
"""


@dataclass(frozen=True)
class Number:
    """One number of the machine, with the interval that holds it in 90 of 100 cases."""

    value: float
    unit: str
    sd: float
    before: tuple[float, float] | None = None
    """Value and standard deviation by drawing and tolerances."""

    @property
    def shown(self) -> bool:
        """Whether it is known better than before."""
        return self.before is None or self.sd < SHOWN * self.before[1]

    def wider(self, factor: float) -> Number:
        """This number with a standard deviation so many times as large."""
        return replace(self, sd=factor * self.sd)

    @property
    def interval90(self) -> tuple[float, float]:
        """It holds the truth in 90 of 100 cases."""
        return interval90(self.value, self.sd)

    def tree(self) -> dict[str, Any]:
        """As JSON carries it."""
        return {"value": self.value, "unit": self.unit, "interval90": list(self.interval90)}

    def before90(self) -> tuple[float, float] | None:
        """The interval by drawing and tolerances."""
        if self.before is None:
            return None
        return interval90(*self.before)


@dataclass(frozen=True)
class Weighed:
    """What a commissioning found."""

    numbers: dict[str, Number]
    """By the names of `truth_machine.yaml`; those that the motion did not show are priors still."""
    mass_kg: float
    """More than drawn up."""
    moment_kg_m: Array
    """First moment of mass about the body's origin, (3), more than drawn up."""
    zeros: Mapping[str, Number]
    """Axis -> what its sensors add to its force at work, N: their zeros, and their gains."""


def zero_name(axis: str) -> str:
    """Name of what both sensors' zeros of a cylinder make together: A_A zero_a - A_B zero_b, N."""
    return f"axes.{axis}.zero_force_n"
