"""What a number of the machine may be, and a group of them."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from testbed.formats.checked import Checked, impossible


def _a_kind(kind: float) -> float:
    if kind not in (0.0, 1.0, 2.0):
        raise impossible("is no kind", "0, 1 or 2")
    return kind


Positive = Annotated[float, Field(gt=0.0)]


NotNegative = Annotated[float, Field(ge=0.0)]


Share = Annotated[float, Field(ge=0.0, lt=1.0)]


Length = Annotated[float, Field(gt=0.0, le=10.0)]


Gauge = Annotated[float, Field(ge=-0.9e5, le=1.0e9)]
"""Gauge pressure: the least is a tenth of the atmosphere's."""


Leakage = Annotated[float, Field(ge=0.0, le=1.0e-6)]


Kind = Annotated[float, AfterValidator(_a_kind)]
"""One of three kinds of valve or supply: 0, 1 or 2; what they are stands beside the value."""


Vector = tuple[float, float, float]


Box = tuple[Positive, Positive, Positive]


class Group(Checked):
    """A group of numbers."""
