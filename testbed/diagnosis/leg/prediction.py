"""What a fit says of bins that it has not seen, and how sure whole blocks of time make it."""

from __future__ import annotations

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
    low, high = bounds(fit.coordinates)
    pull = g + prior_g
    free = ~(
        ((fit.theta <= low) & (pull > 0.0)) | ((fit.theta >= high) & (pull < 0.0))
    )  # the others stay at a bound
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


def _folds(problem: Problem, channel: str, by_recording: bool) -> npt.NDArray[np.int64]:
    layout = problem.layout[channel]
    if not by_recording:
        return np.asarray(layout.block % FOLDS, dtype=np.int64)
    order = [series.name for series in problem.series]
    number = np.array([order.index(recording) for _, recording in layout.names], dtype=np.int64)
    return np.asarray(number[layout.group], dtype=np.int64)
