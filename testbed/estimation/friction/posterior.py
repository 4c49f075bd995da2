"""One side of equation (5), F = sigma v + F_c0 + F_s0 exp(-v / c_s): the best four parameters, and
how sure they are.

Given c_s the rest is linear, so that the posterior is a mixture of Gaussians over a grid of c_s
(log-uniform prior between C_LOW and C_HIGH), cut off at sigma, F_c0, F_s0 >= 0. Its spread covers
what Wald intervals
miss: where the motion does not show the Stribeck speed, the interval is as wide as the prior.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from testbed.estimation.cylinder import friction_terms
from testbed.formats.arrays import Array

C_LOW, C_HIGH, C_COUNT = 1e-3, 5e-2, 50
DRAWS, FEWEST = 3000, 400
PRIOR_FACTOR = 3.0
"""Forces are expected within this many times the mean friction (one standard deviation): weak, but
proper.
"""
FADED = 3.0
"""At so many Stribeck speeds its part has faded to a twentieth."""
HUBER = 2.5
"""Standard deviations beyond which a residual gets less weight (E)."""
MAX_LAG = 60


@dataclass(frozen=True)
class Side:
    """(sigma N s/m, F_c0 N, F_s0 N, c_s m/s): least squares `value` (4,), posterior `draws` (k, 4),
    residual N.
    """

    value: Array
    draws: Array
    parts: tuple[bool, bool, bool]
    residual_n: float
    inflation: float
    """`parts`: which of viscous, Coulomb and Stribeck part were fitted. `inflation`: variance of a
    mean of many rows over what independent rows would have, 1 where the model is complete."""


def fit_side(
    speed_m_s: Array,
    force_n: Array,
    parts: tuple[bool, bool, bool] = (True, True, True),
    seed: int = 0,
) -> Side:
    """Fit rows (m,) of |v| > 0 and the friction force against it; a part left out is 0; draws are
    of all of (5).
    """
    grid = np.geomspace(C_LOW, C_HIGH, C_COUNT)
    # Below that the Stribeck part has faded before the slowest row: any size of it would fit.
    grid = grid[grid >= min(float(np.quantile(speed_m_s, 0.02)) / FADED, C_HIGH)]
    scale = np.array([1.0 / max(float(speed_m_s.max()), 1e-3), 1.0, 1.0]) * max(
        float(np.mean(np.abs(force_n))), 1.0
    )
    weight = np.ones_like(force_n)
    for stride in (3, 3, 1):  # a coarse grid will do to find the weights
        value = _least_squares(speed_m_s, force_n, weight, grid[::stride], parts)
        residual = force_n - curve(value, speed_m_s)
        weight = huber_weights(residual, scatter(residual - np.median(residual)))
    spread = float(np.sqrt(np.sum(weight * residual**2) / max(np.sum(weight) - 4.0, 1.0)))
    inflation = correlation_inflation(residual * weight)
    draws = _draw(speed_m_s, force_n, weight, scale, spread**2 * inflation, seed)
    return Side(value, draws, parts, spread, inflation)


def curve(parameters: Array, speed_m_s: Array) -> Array:
    """Friction N at speeds (m,) for parameters (4,)."""
    return np.asarray(friction_terms(speed_m_s, parameters[3]) @ parameters[:3])


def _least_squares(
    speed: Array, force: Array, weight: Array, grid: Array, parts: tuple[bool, bool, bool]
) -> Array:
    """The best (4,), none negative: c_s on the grid, then between its neighbours by a parabola in
    log c_s.
    """
    fits = [
        _constrained(friction_terms(speed, stribeck_speed) * parts, force, weight)
        for stribeck_speed in grid
    ]
    cost = np.array([fit[1] for fit in fits])
    best = int(np.argmin(cost))
    c = grid[best]
    if 0 < best < len(grid) - 1:
        left, mid, right = cost[best - 1 : best + 2]
        bend = left - 2.0 * mid + right
        shift = 0.5 * (left - right) / bend if bend > 0.0 else 0.0
        c = float(np.exp(np.log(c) + shift * np.log(grid[1] / grid[0])))
    theta, _ = _constrained(friction_terms(speed, c) * parts, force, weight)
    return np.append(theta, c)


def _constrained(x: Array, y: Array, weight: Array) -> tuple[Array, float]:
    """Weighted least squares (3,) with no parameter negative, and its cost."""
    from scipy.optimize import nnls

    root = np.sqrt(weight)
    xw, yw = x * root[:, None], y * root
    theta = np.linalg.lstsq(xw, yw, rcond=None)[0]
    if (theta < 0.0).any():
        size = np.maximum(np.linalg.norm(xw, axis=0), 1e-300)
        theta = nnls(xw / size, yw)[0] / size
    return np.asarray(theta, dtype=np.float64), float(np.sum((yw - xw @ theta) ** 2))


def _draw(
    speed: Array, force: Array, weight: Array, scale: Array, variance: float, seed: int
) -> Array:
    """Posterior draws (DRAWS, 4) under flat-ish priors, log-uniform c_s and sigma, F_c0, F_s0 >=
    0.
    """
    rng = np.random.default_rng(seed)
    problem = _Linear(speed, force, weight, 1.0 / (PRIOR_FACTOR * scale) ** 2, variance)
    grid = np.geomspace(C_LOW, C_HIGH, C_COUNT)
    for _ in range(2):  # the second time only where the posterior is, so that the grid resolves it
        level = problem.log_evidence(grid)
        inside = np.flatnonzero(level > level.max() - 12.0)
        grid = np.geomspace(
            grid[max(inside[0] - 1, 0)], grid[min(inside[-1] + 1, C_COUNT - 1)], C_COUNT
        )
    level = problem.log_evidence(grid)
    p = np.exp(level - level.max())
    means, roots = problem.gaussians(grid)
    which = rng.choice(C_COUNT, 8 * DRAWS, p=p / p.sum())
    theta = means[which] + np.einsum(
        "nij,nj->ni", roots[which], rng.standard_normal((len(which), 3))
    )
    allowed = np.flatnonzero((theta >= 0.0).all(axis=1))
    if len(allowed) >= FEWEST:
        allowed = allowed[:DRAWS]
        return np.column_stack([theta[allowed], grid[which[allowed]]])
    # next to nothing is allowed: draws are moved to the nearest allowed point in the metric of
    # their own precision
    few = slice(0, FEWEST)
    moved = [
        _nearest_allowed(drawn, roots[root])
        for drawn, root in zip(theta[few], which[few], strict=True)
    ]
    return np.column_stack([np.array(moved), grid[which[few]]])


def _nearest_allowed(theta: Array, root: Array) -> Array:
    """Argmin over x >= 0 of |root^-1 (x - theta)|."""
    from scipy.optimize import nnls

    whitening = np.linalg.inv(root)
    size = np.linalg.norm(whitening, axis=0)
    return np.asarray(nnls(whitening / size, whitening @ theta)[0] / size, dtype=np.float64)


@dataclass(frozen=True)
class _Linear:
    """The linear problem that remains for a given c_s: Gaussian rows, Gaussian prior of precision
    `prior` (3,).
    """

    speed: Array
    force: Array
    weight: Array
    prior: Array
    variance: float

    def _solve(self, grid: Array) -> tuple[Array, Array, Array]:
        """Means (k, 3), precisions (k, 3, 3) and costs (k,) for all c_s of the grid at once."""
        x = friction_terms(self.speed, grid[:, None])
        weighted = x.transpose(0, 2, 1) * (self.weight / self.variance)
        precision = weighted @ x + np.diag(self.prior)
        right = weighted @ self.force
        mean = np.linalg.solve(precision, right[:, :, None])[:, :, 0]
        misfit = (self.force - (x @ mean[:, :, None])[:, :, 0]) ** 2 @ self.weight / self.variance
        return np.asarray(mean), precision, np.asarray(misfit + mean**2 @ self.prior)

    def log_evidence(self, grid: Array) -> Array:
        """Log p(rows | c_s) up to a constant, (len(grid),)."""
        _, precision, cost = self._solve(grid)
        return np.asarray(-0.5 * cost - 0.5 * np.linalg.slogdet(precision)[1])

    def gaussians(self, grid: Array) -> tuple[Array, Array]:
        """Means (k, 3) and roots (k, 3, 3) of the covariances."""
        mean, precision, _ = self._solve(grid)
        # in units of the prior no eigenvalue is below 1, however alike the columns are
        unit = 1.0 / np.sqrt(self.prior)
        values, vectors = np.linalg.eigh(precision * unit[:, None] * unit)
        return mean, np.asarray(
            unit[:, None] * vectors / np.sqrt(np.maximum(values, 1.0))[:, None, :]
        )


def scatter(residual: Array) -> float:
    """Standard deviation of residuals (m,) about 0 by their median size; never quite 0."""
    return max(1.4826 * float(np.median(np.abs(residual))), 1e-9)


def huber_weights(residual: Array, spread: float) -> Array:
    """Weights (m,) under which residuals beyond HUBER standard deviations pull no more than one
    there.
    """
    return np.minimum(1.0, HUBER * spread / np.maximum(np.abs(residual), 1e-12))


def correlation_inflation(residual: Array) -> float:
    """1 + 2 sum of the residual's autocorrelations up to the first pair that is not positive
    (Geyer); at least 1.
    """
    centred = residual - residual.mean()
    power = float(centred @ centred)
    if power <= 0.0 or len(centred) < 10:
        return 1.0
    lags = min(MAX_LAG, len(centred) // 4)
    rho = [float(centred[:-index] @ centred[index:]) / power for index in range(1, lags + 1)]
    total = 1.0
    for lag in range(0, len(rho) - 1, 2):
        pair = rho[lag] + rho[lag + 1]
        if pair <= 0.0:
            break
        total += 2.0 * pair
    return max(1.0, total)
