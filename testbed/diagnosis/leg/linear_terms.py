"""Linear terms beside a fit: what they would explain of its residual, without another search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.fit import Fit, normal_equations
from testbed.diagnosis.leg.problem import Problem
from testbed.effects.terms import Coordinate

Array = npt.NDArray[np.float64]
RIDGE = 1e-8


def with_terms(
    problem: Problem,
    fit: Fit,
    channel: str,
    names: Sequence[str],
    columns: Array,
    known: Array | None = None,
) -> Fit:
    """The fit with columns (bins, k) of one channel of its residual as linear terms, after one
    step: exact for them. `known`: standard deviation of each one's weight about 0, where that is
    known beforehand.
    """
    size = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-30)
    columns = columns / size
    extra = tuple(
        Coordinate(
            channel,
            name,
            0.0,
            -1.0,
            1.0,
            1.0,
            moves=(channel,),
            prior=None if known is None else (0.0, max(float(known[place] * size[place]), 1e-30)),
        )
        for place, name in enumerate(names)
    )
    jacobian = {
        name: np.hstack([j, columns if name == channel else np.zeros((len(j), len(extra)))])
        for name, j in fit.jacobian.items()
    }
    theta = np.append(fit.theta, np.zeros(len(extra)))
    more = replace(fit, coordinates=fit.coordinates + extra, theta=theta, jacobian=jacobian)
    h, g, unit = normal_equations(problem, more)
    ridge = RIDGE * max(float(np.trace(h)) / len(unit), 1.0) * np.eye(len(unit))
    step = -np.linalg.solve(h + ridge, g) * unit
    return replace(
        more,
        theta=more.theta + step,
        residual={
            name: value + more.jacobian[name] @ step for name, value in more.residual.items()
        },
    )
