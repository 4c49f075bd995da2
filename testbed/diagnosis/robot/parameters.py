"""The parameters of effects that were found, with intervals, from the numbers of their
signatures.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.groups import Balances, Candidate
from testbed.diagnosis.robot.hypotheses import Hypothesis
from testbed.diagnosis.robot.together import of_first
from testbed.recording.leg_model import Parameter

Array = npt.NDArray[np.float64]
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
    out, first = [], 0
    for name in chosen.names:
        candidate = balances.candidates[name]
        size = len(candidate.signature)
        own = slice(first, first + size)
        first += size
        covariance = chosen.covariance[own, own] * width**2
        out.append(_found(balances, candidate, chosen.mean[own], covariance))
    return tuple(out)


def _found(balances: Balances, candidate: Candidate, mean: Array, covariance: Array) -> Found:
    rng = np.random.default_rng(0)
    numbers = list(candidate.signature)

    def parameters(values: Array) -> dict[str, float]:
        linear = of_first(dict(zip(numbers, values.tolist(), strict=True)))
        return candidate.effect.from_linear(linear, balances.body.seen, candidate.place)

    best = parameters(mean)
    drawn = [parameters(v) for v in rng.multivariate_normal(mean, covariance, DRAWS)]
    out = {}
    for key, value in best.items():
        spec = candidate.effect.spec(key)
        low, high = np.quantile([d[key] for d in drawn], [0.05, 0.95])
        if np.isclose(low, high, rtol=1e-9, atol=0.0):  # the balances say nothing of it
            low, high = min(spec.prior[0], value), max(spec.prior[1], value)
        ends = (float(np.clip(low, spec.low, spec.high)), float(np.clip(high, spec.low, spec.high)))
        inside = float(np.clip(value, spec.low, spec.high))
        out[key] = Parameter(value=inside, unit=spec.unit, interval90=ends)
    return Found(candidate.effect.kind, candidate.place, out)
