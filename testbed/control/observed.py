"""One number that an agent or a trained controller sees: what it is, and the range that becomes -1
to 1.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Observed:
    """A row of an observation's table."""

    column: str
    """Column of the run's data, or a name under `orders.` or `control.`: what control itself
    ordered or worked out.
    """
    meaning: str
    unit: str
    frame: str
    low: float
    high: float
