"""Robust least squares over groups of unlike noise, and its linearised leave-blocks-out
prediction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.points import FRICTION, NUISANCE, STRAIGHT, Point, point, start_vector
from testbed.diagnosis.leg.problem import Problem
from testbed.effects.terms import Coordinate
from testbed.estimation.leg.flow import EDGES
from testbed.recording.leg_model import LegModel

Array = npt.NDArray[np.float64]
HUBER = 3.0
FEWEST_BINS = 20
"""Of a group, without which its noise is not known and it does not count."""
RESCALED = 12
"""Iterations in which the noise of the groups is estimated anew; then it stays, so that a fit comes
to an end.
"""
LEAST_GAIN = 0.3
"""A fall of the cost, in units of log-likelihood of bins that are far from independent, that ends a
fit.
"""
TRIES = 10
"""Steps tried in one iteration, each eight times as damped as the one before: far from the answer
all but the shortest may lead uphill."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted hypothesis. `residual`, `jacobian`: per channel, stacked bins (fitted units)."""

    coordinates: tuple[Coordinate, ...]
    theta: Array
    at: Point
    residual: dict[str, Array]
    jacobian: dict[str, Array]
    scale: dict[str, Array]
    """Channel -> noise of each group."""
    covariance: Array

    def model(self, base: LegModel) -> LegModel:
        """The base model with this fit's friction (no effects)."""
        return self.at.model(base)


def residuals(problem: Problem, at: Point, channels: Sequence[str]) -> dict[str, Array]:
    """Stacked residuals of some channels."""
    model = at.model(problem.base)
    out: dict[str, Array] = {}
    if "force" in channels:
        out["force"] = problem.force(model, at.effects)
    if "flow" in channels or "supply" in channels:
        out |= {
            name: value
            for name, value in problem.flow(model, at.effects, at.edges).items()
            if name in channels
        }
    return out


def group_scale(
    residual: Array, count: Array, group: npt.NDArray[np.int64], groups: int, floor: float
) -> Array:
    """Robust standard deviation of each group: 1.48 MAD about 0, at least `floor`."""
    out = np.full(groups, np.inf)
    for index in range(groups):
        here = np.abs(residual[(group == index) & (count > 0)])
        if here.size > FEWEST_BINS:
            # Between the median and the root mean square: tails count, single bursts do not.
            clipped = np.minimum(here, 4.0 * 1.48 * np.median(here))
            out[index] = max(float(np.sqrt(np.mean(clipped**2))), floor)
    return out


FLOORS = {"force": 1e-3, "flow": 1e-8, "supply": 10.0}


def weights(
    problem: Problem, residual: dict[str, Array], scale: dict[str, Array]
) -> dict[str, Array]:
    """Square roots of the weights of each bin: 1 / noise, less for outliers (Huber), 0 for empty
    bins.
    """
    out = {}
    for channel, value in residual.items():
        layout = problem.layout[channel]
        size = scale[channel][layout.group] * layout.relative
        with np.errstate(invalid="ignore", divide="ignore"):
            standardised = np.abs(value) / size
            root = np.sqrt(np.minimum(1.0, HUBER / np.maximum(standardised, 1e-12)))
            out[channel] = np.where((layout.count > 0) & np.isfinite(size), root / size, 0.0)
    return out


def scales(problem: Problem, residual: dict[str, Array]) -> dict[str, Array]:
    """The noise of every group."""
    return {
        name: group_scale(
            value / problem.layout[name].relative,
            problem.layout[name].count,
            problem.layout[name].group,
            len(problem.layout[name].names),
            FLOORS[name],
        )
        for name, value in residual.items()
    }


def jacobian(
    problem: Problem,
    coordinates: Sequence[Coordinate],
    theta: Array,
    fixed: Point,
    at_zero: dict[str, Array],
) -> dict[str, Array]:
    """Differences forward (backward at an upper bound), channel by channel; exact where friction
    and the edges enter straight.

    A coordinate that does not move a channel has a zero column.
    """
    out = {name: np.zeros((len(value), len(theta)), order="F") for name, value in at_zero.items()}
    exact = {
        **(_exact_friction(problem, coordinates, theta, fixed) if "force" in at_zero else {}),
        **(_exact_edges(problem, coordinates, theta, fixed) if "flow" in at_zero else {}),
        **(_exact_supply(problem, coordinates) if "supply" in at_zero else {}),
    }
    for index, coordinate in enumerate(coordinates):
        if index in exact:
            channel, column = exact[index]
            out[channel][:, index] = column
            continue
        moved = [move for move in coordinate.moves if move in at_zero]
        if not moved:
            continue
        step = 1e-3 * coordinate.scale
        if theta[index] + step > (np.log(coordinate.high) if coordinate.log else coordinate.high):
            step = -step  # at its upper bound nothing moves forward
        shifted = theta.copy()
        shifted[index] += step
        for channel, residual in residuals(
            problem, point(coordinates, shifted, fixed), moved
        ).items():
            out[channel][:, index] = (residual - at_zero[channel]) / step
    return out


def _exact_friction(
    problem: Problem, coordinates: Sequence[Coordinate], theta: Array, fixed: Point
) -> dict[int, tuple[str, Array]]:
    """Index of a coordinate -> its channel and column of the Jacobian, for friction that enters
    straight.
    """
    friction = {
        index: coordinate.name
        for index, coordinate in enumerate(coordinates)
        if coordinate.owner == FRICTION
    }
    wanted = {key: STRAIGHT.index(name) for key, name in friction.items() if name in STRAIGHT}
    if not wanted:
        return {}
    at = point(coordinates, theta, fixed)
    found = problem.straight_columns(at.model(problem.base), at.effects)
    if found is None:
        return {}
    return {index: ("force", found[:, column]) for index, column in wanted.items()}


def _exact_edges(
    problem: Problem, coordinates: Sequence[Coordinate], theta: Array, fixed: Point
) -> dict[int, tuple[str, Array]]:
    """Exact columns of the Jacobian for the valve's edges."""
    wanted = {
        index: coordinate.name
        for index, coordinate in enumerate(coordinates)
        if coordinate.owner == NUISANCE and coordinate.name in ("gain", *EDGES)
    }
    if not wanted:
        return {}
    at = point(coordinates, theta, fixed)
    found = problem.edge_columns(at.effects, at.edges)
    if found is None:
        return {}
    return {index: ("flow", found[name]) for index, name in wanted.items()}


def _exact_supply(
    problem: Problem, coordinates: Sequence[Coordinate]
) -> dict[int, tuple[str, Array]]:
    """Exact column of the Jacobian for what the supply is set beside its nominal pressure."""
    column = np.where(problem.layout["supply"].count > 0, -1.0, 0.0)
    places = [place for place, one in enumerate(coordinates) if one.name == "supply_off_pa"]
    return {place: ("supply", column) for place in places}


def solve(
    problem: Problem,
    coordinates: Sequence[Coordinate],
    fixed: Point,
    iterations: int = 12,
    scale: dict[str, Array] | None = None,
    rescale: bool = True,
) -> Fit:
    """Levenberg-Marquardt with bounds, robust weights and group noise that is re-estimated on the
    way.
    """
    channels = problem.channels()
    theta = start_vector(coordinates)
    low, high = bounds(coordinates)
    unit = np.array([coordinate.scale for coordinate in coordinates])
    r = residuals(problem, point(coordinates, theta, fixed), channels)
    scale = scale or scales(problem, r)
    damping = 1e-3
    jac = jacobian(problem, coordinates, theta, fixed, r)
    for iteration in range(iterations):
        w = weights(problem, r, scale)
        h, g = normal(jac, r, w, unit)
        prior_h, prior_g = prior(coordinates, theta, unit)
        now = _cost(problem, r, scale) + _prior_cost(coordinates, theta)
        accepted = False
        for _ in range(TRIES):
            damped = h + prior_h + damping * np.diag(np.diag(h + prior_h) + 1e-9)
            step = _step(damped, g + prior_g, theta, low, high) * unit
            step = np.clip(
                step, -3.0 * unit * (1 if iteration else 3), 3.0 * unit * (1 if iteration else 3)
            )
            trial = np.clip(theta + step, low, high)
            r_trial = residuals(problem, point(coordinates, trial, fixed), channels)
            cost = _cost(problem, r_trial, scale) + _prior_cost(coordinates, trial)
            if np.isfinite(cost) and cost < now:
                accepted = True
                break
            damping = max(damping * 8.0, 1e-3)
        if not accepted:
            break
        gain = now - cost
        theta, r = trial, r_trial
        damping = max(damping / 6.0, 1e-7)
        jac = jacobian(problem, coordinates, theta, fixed, r)
        if rescale and iteration < RESCALED:
            scale = scales(problem, r)
        if gain < LEAST_GAIN and iteration > 0:
            break
    at = point(coordinates, theta, fixed)
    return with_covariance(problem, tuple(coordinates), theta, at, (r, jac, scale))


def with_covariance(
    problem: Problem,
    coordinates: tuple[Coordinate, ...],
    theta: Array,
    at: Point,
    found: tuple[dict[str, Array], dict[str, Array], dict[str, Array]],
) -> Fit:
    """The fit at a vector, with its covariance; `found`: residual, Jacobian and noise there."""
    residual, jac, scale = found
    unit = np.array([coordinate.scale for coordinate in coordinates])
    h, _ = normal(jac, residual, weights(problem, residual, scale), unit)
    prior_h, _ = prior(coordinates, theta, unit)
    inverse = np.linalg.pinv(h + prior_h + 1e-9 * np.eye(len(unit)))
    covariance = np.asarray(inverse * np.outer(unit, unit), dtype=np.float64)
    return Fit(coordinates, theta, at, residual, jac, scale, covariance)


def bounds(coordinates: Sequence[Coordinate]) -> tuple[Array, Array]:
    """(lowest, highest) of every coordinate in fitted units."""
    with np.errstate(divide="ignore"):
        low = np.array(
            [
                np.log(coordinate.low) if coordinate.log else coordinate.low
                for coordinate in coordinates
            ]
        )
        high = np.array(
            [
                np.log(coordinate.high) if coordinate.log else coordinate.high
                for coordinate in coordinates
            ]
        )
    return low, high


def _step(h: Array, g: Array, theta: Array, low: Array, high: Array) -> Array:
    """-h^-1 g with the coordinates held that stand at a bound and would go beyond it.

    To clip a step that they were part of would leave the others where they make sense with them
    only.
    """
    free = np.ones(len(g), dtype=bool)
    while True:
        step = np.zeros(len(g))
        step[free] = -np.linalg.lstsq(h[np.ix_(free, free)], g[free], rcond=None)[0]
        beyond = ((theta <= low) & (step < 0.0)) | ((theta >= high) & (step > 0.0))
        if not beyond.any():
            return step
        free &= ~beyond


def step_gain(problem: Problem, at: Fit, coordinates: Sequence[Coordinate], extra: int) -> float:
    """Fall of the cost, against the fit `at`, that one Gauss-Newton step promises after `extra`
    more coordinates.

    The Jacobian of the shared coordinates is the fit's own; only the new columns are computed. Bins
    weigh as in the fit: all of a quiet recording would be outliers until the others give way.
    """
    channels = tuple(at.residual)
    theta = start_vector(coordinates)
    start = point(coordinates, theta, at.at)
    r = residuals(problem, start, channels)
    new = jacobian(problem, coordinates[-extra:], theta[-extra:], start, r)
    unit = np.array([coordinate.scale for coordinate in coordinates])
    kept = [i for i, one in enumerate(at.coordinates) if one.owner != coordinates[-1].owner]
    jac = {c: np.hstack([at.jacobian[c][:, kept], new[c]]) for c in channels}
    w = weights(problem, at.residual, at.scale)
    h, g = normal(jac, r, w, unit)
    prior_h, prior_g = prior(coordinates, theta, unit)
    ridge = (1e-8 * np.trace(h) / len(unit) + 1e-9) * np.eye(len(unit))
    step = _step(h + prior_h + ridge, g + prior_g, theta, *bounds(coordinates))
    promised = -0.5 * float((g + prior_g) @ step)
    return _squares(at.residual, w) - _squares(r, w) + promised


def _squares(r: dict[str, Array], w: dict[str, Array]) -> float:
    """Half the weighted sum of squares of some residuals."""
    return 0.5 * sum(float(np.sum((w[channel] * values) ** 2)) for channel, values in r.items())


def normal_equations(problem: Problem, fit: Fit) -> tuple[Array, Array, Array]:
    """(Hessian, gradient, scales of the coordinates) of a fit's cost with its priors, in units of
    the scales.
    """
    unit = np.array([coordinate.scale for coordinate in fit.coordinates])
    h, g = normal(fit.jacobian, fit.residual, weights(problem, fit.residual, fit.scale), unit)
    prior_h, prior_g = prior(fit.coordinates, fit.theta, unit)
    return h + prior_h, g + prior_g, unit


def normal(
    jac: dict[str, Array], r: dict[str, Array], w: dict[str, Array], unit: Array
) -> tuple[Array, Array]:
    """(Hessian, gradient) of the weighted squares of the residuals r, in units of the coordinates'
    scales.
    """
    size = len(unit)
    h, g = np.zeros((size, size)), np.zeros(size)
    for channel, columns in jac.items():
        moved = np.flatnonzero(columns.any(axis=0))  # most parameters leave most channels alone
        weighted = columns[:, moved] * unit[moved] * w[channel][:, None]
        h[np.ix_(moved, moved)] += weighted.T @ weighted
        g[moved] += weighted.T @ (w[channel] * r[channel])
    return h, g


def _cost(problem: Problem, r: dict[str, Array], scale: dict[str, Array]) -> float:
    """Half the Huber sum over all bins."""
    total = 0.0
    for channel, values in r.items():
        layout = problem.layout[channel]
        size = scale[channel][layout.group] * layout.relative
        use = (layout.count > 0) & np.isfinite(size)
        standardised = np.abs(values[use]) / size[use]
        total += float(
            np.sum(
                np.where(
                    standardised < HUBER,
                    0.5 * standardised * standardised,
                    HUBER * standardised - 0.5 * HUBER**2,
                )
            )
        )
    return total


def prior(coordinates: Sequence[Coordinate], theta: Array, unit: Array) -> tuple[Array, Array]:
    """Hessian and gradient of what is known of the coordinates beforehand."""
    h, g = np.zeros((len(unit), len(unit))), np.zeros(len(unit))
    for index, coordinate in enumerate(coordinates):
        if coordinate.prior is not None:
            centre, sigma = coordinate.prior
            h[index, index] = (unit[index] / sigma) ** 2
            g[index] = unit[index] * (theta[index] - centre) / sigma**2
    return h, g


def _prior_cost(coordinates: Sequence[Coordinate], theta: Array) -> float:
    pairs = zip(coordinates, theta, strict=True)
    return float(
        sum(
            0.5 * ((value - coordinate.prior[0]) / coordinate.prior[1]) ** 2
            for coordinate, value in pairs
            if coordinate.prior
        )
    )
