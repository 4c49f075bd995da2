"""The parameters of effects that were found, with intervals, from the numbers of their
signatures.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from testbed.diagnosis.robot.groups import Balances
from testbed.diagnosis.robot.hypotheses import Hypothesis
from testbed.diagnosis.robot.nonlinear_fit import Fitted, Part, fitted
from testbed.diagnosis.robot.probabilities import calibration
from testbed.effects import by_name
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

    @property
    def may_be_nothing(self) -> bool:
        """Whether a number by which alone the effect is none (a spring's stiffness of 0, a factor
        of 1) lies within its interval.
        """
        values = {key: parameter.value for key, parameter in self.parameters.items()}
        for key, parameter in self.parameters.items():
            low, high = parameter.interval90 or (parameter.value, parameter.value)
            for nothing in (0.0, 1.0):
                if low <= nothing <= high and _is_none(self.kind, values | {key: nothing}):
                    return True
        return False


def _is_none(kind: str, values: Mapping[str, float]) -> bool:
    """Whether an effect with these parameters does nothing."""
    return not any(by_name(kind).to_linear(values).values())


@dataclass(frozen=True)
class Doubt:
    """By how much more intervals are to be doubted than the linear model says.

    `width`: factor of every interval. `law`: share of a number (`effect.parameter`) by which its
    law may be wrong, half width of 90 %.
    """

    width: float
    law: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def shipped(cls) -> Doubt:
        """As fitted to runs with known answers."""
        return cls(float(calibration()["width"]), calibration()["law"])

    def ends(
        self, kind: str, key: str, value: float, linear: tuple[float, float]
    ) -> tuple[float, float]:
        """Ends of an interval, from those that the widened linear model has."""
        wrong = self.law.get(f"{kind}.{key}", 0.0) * abs(value)
        low, high = linear
        return value - math.hypot(value - low, wrong), value + math.hypot(high - value, wrong)


def found_in(balances: Balances, chosen: Hypothesis, doubt: Doubt) -> tuple[Found, ...]:
    """The effects of a hypothesis, with intervals of 90 %."""
    fit = fitted(balances, chosen)
    return tuple(_found(balances, fit, part, doubt) for part in fit.parts)


def _found(balances: Balances, fit: Fitted, part: Part, doubt: Doubt) -> Found:
    rng = np.random.default_rng(0)
    candidate = part.candidate
    own = slice(part.first, part.first + part.size)
    drawn = np.tile(fit.mean, (DRAWS, 1))
    covariance = fit.covariance[own, own] * doubt.width**2
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
        low, high = doubt.ends(candidate.effect.kind, key, value, (low, high))
        ends = (float(np.clip(low, spec.low, spec.high)), float(np.clip(high, spec.low, spec.high)))
        inside = float(np.clip(value, spec.low, spec.high))
        out[key] = Parameter(value=inside, unit=spec.unit, interval90=ends)
    return Found(candidate.effect.kind, candidate.place, out)
