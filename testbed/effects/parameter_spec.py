"""A parameter of an effect: what it may be, what it is expected to be, and how it is fitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from testbed.effects.terms import Coordinate

STANDARD_DEVIATIONS_OF_90 = 3.3
"""Width of the interval that holds 90 % of a normal distribution, in standard deviations."""
BEYOND_PRIOR = 1e3
"""Factor by which a logarithmic parameter may leave the range in which it is expected."""


@dataclass(frozen=True)
class ParameterSpec:
    """A parameter: hard bounds of what is physical, and the range in which 90 % of cases are
    expected.
    """

    name: str
    unit: str
    low: float
    high: float
    prior: tuple[float, float]
    text: str
    default: float | None = None
    """Where given, the parameter is a further shape beyond the contract's formula and may be left
    out.
    """
    log: bool = False
    """A size without a sign that may be off by a factor: fitted as its logarithm."""

    @property
    def start(self) -> float:
        """Where a fit begins that knows nothing better."""
        low, high = self.prior
        if self.default is not None:
            return self.default
        return float(np.sqrt(low * high)) if low > 0.0 else 0.0

    def coordinate(self, owner: str, start: float, moves: tuple[str, ...]) -> Coordinate:
        """The parameter as a number to be fitted, with its prior as a weak one."""
        low, high = self.prior
        if self.log:
            width = np.log(high / low) / STANDARD_DEVIATIONS_OF_90
            bounds = max(self.low, low / BEYOND_PRIOR), min(self.high, high * BEYOND_PRIOR)
            prior = 0.5 * np.log(low * high), 3.0 * width
        else:
            width = (high - low) / STANDARD_DEVIATIONS_OF_90
            bounds, prior = (self.low, self.high), (0.5 * (low + high), 4.0 * width)
        return Coordinate(owner, self.name, start, *bounds, width, self.log, moves, prior)
