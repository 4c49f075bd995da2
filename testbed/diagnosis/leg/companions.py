"""Channels that ride along (a current, a temperature): does what no name explains go with one of
them?

Each is offered as a force of its own, as one that the whole friction is the larger for, bristles
and all, and as a viscous force: a damper whose current is changed turns round over a distance as
its friction does. It counts where recordings that it was not fitted on are predicted better; what
it means is for the reader to say.
"""

from __future__ import annotations

import numpy as np

from testbed.diagnosis.leg.evidence import of_residual
from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.linear_terms import RIDGE, with_terms
from testbed.diagnosis.leg.prediction import held_out
from testbed.diagnosis.leg.problem import Array, Problem
from testbed.diagnosis.leg.series import Series

LEAST_FALL = 0.1
"""Share by which a channel has to lower the residual of what is held out to be spoken of."""
TERMS = ("force", "friction", "viscous")


def companions(problem: Problem, fit: Fit) -> dict[str, float]:
    """Channel -> share by which it lowers the held-out force residual, the largest first; those
    above LEAST_FALL.
    """
    names = set.intersection(*(set(series.extra) for series in problem.series))
    falls = {name: _fall(problem, fit, name) for name in sorted(names)}
    ranked = sorted(falls.items(), key=lambda item: -item[1])
    return {name: fall for name, fall in ranked if fall > LEAST_FALL}


def _fall(problem: Problem, fit: Fit, name: str) -> float:
    values = np.concatenate([series.extra[name] for series in problem.series])
    middle, spread = float(np.mean(values)), float(np.std(values))
    if spread <= 1e-9 * max(abs(middle), 1.0):
        return 0.0
    frictions_n = problem.frictions_n(fit.model(problem.base), fit.at.effects)
    columns = np.concatenate(
        [
            _columns(series, (series.extra[name] - middle) / spread, friction_n)
            for series, friction_n in zip(problem.series, frictions_n, strict=True)
        ]
    )
    more = with_terms(problem, fit, "force", [f"{name} as {term}" for term in TERMS], columns)
    return 1.0 - _size(problem, more, RIDGE) / _size(problem, fit)


def _columns(series: Series, channel: Array, friction_n: Array) -> Array:
    mask = series.trusted & series.clear
    terms = (channel, channel * friction_n, channel * series.signals.velocity_m_s)
    return np.stack([series.binned(term, mask)[0] for term in terms], axis=1)


def _size(problem: Problem, fit: Fit, ridge: float = 1e-6) -> float:
    """Typical scale of the held-out force residual, N."""
    by_recording = len(problem.series) > 1
    found = of_residual(
        problem, {"force": held_out(problem, fit, ridge, by_recording=by_recording)["force"]}
    )
    return float(np.exp(np.mean(np.log(list(found.scale.values())))))
