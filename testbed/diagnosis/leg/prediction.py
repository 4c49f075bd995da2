"""What a fit says of bins that it has not seen, and how sure whole blocks of time make it."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.fit import (
    Array,
    Fit,
    bounds,
    normal,
    normal_equations,
    prior,
    weights,
)
from testbed.diagnosis.leg.problem import Problem

FOLDS = 8
UNKNOWN = 100.0
"""Growth of a number's variance without one recording from which on the others as good as do not
know it: they say ten times less sharply what it is (E)."""


def block_covariance(problem: Problem, fit: Fit) -> Array:
    """Covariance (k, k) of the fitted coordinates that takes whole blocks of time as witnesses, not
    bins.

    H^-1 (sum of g_b g_b') H^-1 with the cost's gradient g_b over block b: what is left inside a
    block may be as coloured, and as unlike in size from block to block, as it likes.
    """
    h, _, unit = normal_equations(problem, fit)
    w = weights(problem, fit.residual, fit.scale)
    blocks = 1 + max(int(problem.layout[channel_].block.max()) for channel_ in fit.residual)
    gradient = np.zeros((blocks, len(unit)))
    for channel, columns in fit.jacobian.items():
        pull = w[channel] ** 2 * fit.residual[channel]
        np.add.at(gradient, problem.layout[channel].block, columns * unit * pull[:, None])
    inverse = np.linalg.pinv(h + 1e-9 * np.eye(len(unit)))
    return np.asarray(
        inverse @ (gradient.T @ gradient) @ inverse * np.outer(unit, unit), dtype=np.float64
    )


def held_out(
    problem: Problem, fit: Fit, ridge: float = 1e-6, by_recording: bool = False
) -> dict[str, Array]:
    """Residuals of every bin as predicted from the other folds: blocks are dealt to FOLDS folds in
    turn, or every recording is a fold of its own.

    Linearised at the fit: leaving a fold out moves the parameters by (H - H_f)^-1 J_f' W r_f.
    """
    unit = np.array([coordinate.scale for coordinate in fit.coordinates])
    w = weights(problem, fit.residual, fit.scale)
    h, g = normal(fit.jacobian, fit.residual, w, unit)
    prior_h, prior_g = prior(fit.coordinates, fit.theta, unit)
    free = _free(fit, g + prior_g)  # the others stay at a bound
    total = h + prior_h + ridge * np.eye(len(unit)) * max(np.trace(h) / len(unit), 1.0)
    out = {name: value.copy() for name, value in fit.residual.items()}
    folds = {c: _folds(problem, c, by_recording) for c in fit.jacobian}
    for fold in range(len(problem.series) if by_recording else FOLDS):
        h_fold, g_fold = np.zeros_like(h), np.zeros(len(unit))
        rows = {}
        for channel, columns in fit.jacobian.items():
            here = folds[channel] == fold
            rows[channel] = here
            weighted = columns[here] * unit * w[channel][here, None]
            h_fold += weighted.T @ weighted
            g_fold += weighted.T @ (w[channel][here] * fit.residual[channel][here])
        delta = np.zeros(len(unit))
        delta[free] = np.linalg.solve((total - h_fold)[np.ix_(free, free)], g_fold[free])
        for channel, columns in fit.jacobian.items():
            out[channel][rows[channel]] += (columns[rows[channel]] * unit) @ delta
    return out


def _free(fit: Fit, pull: Array) -> npt.NDArray[np.bool_]:
    """Which coordinates a gradient does not hold at a bound."""
    low, high = bounds(fit.coordinates)
    held = ((fit.theta <= low) & (pull > 0.0)) | ((fit.theta >= high) & (pull < 0.0))
    return np.asarray(~held, dtype=np.bool_)


def shown_by_one(problem: Problem, fit: Fit, owners: Collection[str]) -> frozenset[str]:
    """The recordings without which some number of these owners is as good as unknown: a load is on
    the load cell alone, a cushion where the piston goes to its end.
    """
    h, pull, unit = normal_equations(problem, fit)
    free = np.flatnonzero(_free(fit, pull))
    mine = np.array([fit.coordinates[place].owner in owners for place in free], dtype=np.bool_)
    if not mine.any():
        return frozenset()
    w = weights(problem, fit.residual, fit.scale)
    whole = h[np.ix_(free, free)]
    size = np.sqrt(np.diag(whole))
    size[size == 0.0] = 1.0  # moves nothing: as good as unknown, whatever its unit
    known = _variances(whole, size)[mine]
    found = set()
    for number, series in enumerate(problem.series):
        rest = whole.copy()
        for channel, columns in fit.jacobian.items():
            here = _folds(problem, channel, by_recording=True) == number
            weighted = columns[np.ix_(here, free)] * unit[free] * w[channel][here, None]
            rest -= weighted.T @ weighted
        if (_variances(rest, size)[mine] > UNKNOWN * known).any():
            found.add(series.name)
    return frozenset(found)


def _variances(h: Array, size: Array) -> Array:
    """Diagonal of the inverse of a Hessian with coordinates of these sizes; what it does not
    determine is next to infinite.
    """
    scaled = h / np.outer(size, size) + 1e-10 * np.eye(len(size))
    return np.asarray(np.diag(np.linalg.inv(scaled)) / size**2, dtype=np.float64)


def _folds(problem: Problem, channel: str, by_recording: bool) -> npt.NDArray[np.int64]:
    layout = problem.layout[channel]
    if not by_recording:
        return np.asarray(layout.block % FOLDS, dtype=np.int64)
    order = [series.name for series in problem.series]
    number = np.array([order.index(recording) for _, recording in layout.names], dtype=np.int64)
    return np.asarray(number[layout.group], dtype=np.int64)
