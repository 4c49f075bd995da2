"""The parameters of effects that were found, with intervals, from the numbers of their
signatures.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from testbed.diagnosis.robot.groups import Balances
from testbed.diagnosis.robot.hypotheses import Hypothesis
from testbed.diagnosis.robot.nonlinear_fit import Fitted, Part, fitted
from testbed.recording.leg_model import Parameter

DRAWS = 400
"""Draws of the numbers, of which intervals are the fifth and the ninety-fifth hundredth."""


@dataclass(frozen=True)
class Found:
    """An effect at its place with its parameters."""

    kind: str
    place: str
    parameters: Mapping[str, Parameter]

    @property
    def name(self) -> str:
        """`sensor.gain_a@fl_vertical`."""
        return f"{self.kind}@{self.place}"


def found_in(balances: Balances, chosen: Hypothesis, width: float) -> tuple[Found, ...]:
    """The effects of a hypothesis. `width`: by how much wider the intervals are than the linear
    model says.
    """
    fit = fitted(balances, chosen)
    return tuple(_found(balances, fit, part, width) for part in fit.parts)


def _found(balances: Balances, fit: Fitted, part: Part, width: float) -> Found:
    rng = np.random.default_rng(0)
    candidate = part.candidate
    own = slice(part.first, part.first + part.size)
    drawn = np.tile(fit.mean, (DRAWS, 1))
    covariance = fit.covariance[own, own] * width**2
    drawn[:, own] = rng.multivariate_normal(fit.mean[own], covariance, DRAWS)
    tried = [fit.parameters(part, numbers, balances) for numbers in drawn]
    out = {}
    for key, value in fit.parameters(part, fit.mean, balances).items():
        spec = candidate.effect.spec(key)
        low, middle, high = np.quantile([d[key] for d in tried], [0.05, 0.5, 0.95])
        if not low <= value <= high:  # a number that leaps with those that it is made of
            value = middle
        if np.isclose(low, high, rtol=1e-9, atol=0.0):  # the balances say nothing of it
            low, high = min(spec.prior[0], value), max(spec.prior[1], value)
        ends = (float(np.clip(low, spec.low, spec.high)), float(np.clip(high, spec.low, spec.high)))
        inside = float(np.clip(value, spec.low, spec.high))
        out[key] = Parameter(value=inside, unit=spec.unit, interval90=ends)
    return Found(candidate.effect.kind, candidate.place, out)
