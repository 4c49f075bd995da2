"""Intervals of 90 % of normal distributions, by which model files and recordings state how sure
they are; and numbers with their intervals and units as people read them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

Z90 = 1.645
"""Half of the interval that holds 90 % of a normal distribution, in standard deviations."""


def interval90(value: float, sd: float) -> tuple[float, float]:
    """It holds the truth in 90 of 100 cases."""
    return value - Z90 * sd, value + Z90 * sd


def sd_of(interval: tuple[Any, Any]) -> Any:
    """Standard deviation of the normal distribution that has this interval of 90 %;
    numbers or arrays.
    """
    return (interval[1] - interval[0]) / (2.0 * Z90)


SMALL = 1.0e-4
"""Half of an interval below which numbers are written as powers of ten."""


def rounded(value: float, interval: Sequence[float]) -> tuple[str, str, str]:
    """A number and the ends of its interval, to the second digit of half of that interval."""
    low, high = interval
    half = 0.5 * (high - low)
    if not half >= SMALL or not math.isfinite(half):
        return f"{value:.3g}", f"{low:.3g}", f"{high:.3g}"
    decimals = max(1 - math.floor(math.log10(half)), 0)
    first, second, third = (round(number, decimals) + 0.0 for number in (value, low, high))
    return f"{first:.{decimals}f}", f"{second:.{decimals}f}", f"{third:.{decimals}f}"


def unit_name(unit: str) -> str:
    """A unit as people read it: powers raised, nothing for a pure number."""
    return "" if unit == "1" else unit.replace("m2", "m²").replace("m3", "m³")
