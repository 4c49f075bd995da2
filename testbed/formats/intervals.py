"""Intervals of 90 % of normal distributions, by which model files and recordings tell how sure
they are.
"""

from __future__ import annotations

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
