"""By how much a bench's friction may be shifted at a pressure, where each run holds one pressure
and friction's level differs from run to run.

A hierarchical model of what `identify` leaves of the level of each run: a constant, a straight
trend with the pressure, a smooth departure from it, and each run's own. How large a run's own and
the departure are is not known from few runs: nine models are averaged by how probable they make
the runs (Bayes). A seal is pressed on by the pressure: before any run is seen, the trend makes
between none and all of the friction at the mean pressure.

A shift is as large as is expected, unless that would make a further run of this pressure err more
than identified with a chance of over RISK. What the course of the friction along a stroke gains
makes room for a shift that is in vain. The models were chosen on 220 simulated seals; RISK
between 0.015 and 0.05, after both were seen on 28 measured runs: with it runs of simulated seals
err more seldom than with what it replaced.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq
from scipy.stats import norm

Array = npt.NDArray[np.float64]
RISK = 0.05
"""Chance that a shift makes a further run err more than identified."""
OWN = (0.04, 0.08, 0.14)
"""Standard deviations of a run's own level, shares of the friction. Repeats of one measured seal at
one pressure differ by 6 to 14 %."""
DEPARTURE = (0.0, 0.1, 0.3)
"""Standard deviations of a smooth departure from a straight trend, shares of the friction."""
DEPARTURE_LENGTH = 0.5
"""Pressure in which it changes, a share of the runs' mean pressure."""
CONSTANT = 0.3
"""Standard deviation of the level that all runs share, a share of the friction."""
TREND, TREND_SD = 0.5, 0.3
"""Friction that grows with the pressure at the mean pressure, and its standard deviation, shares of
the friction: none to all of it."""
FARTHEST_SD = 8.0


@dataclass(frozen=True, eq=False)
class Levels:
    """What `identify` leaves of each run's level (runs,): pressure, Pa; half of what the force out
    exceeds that back, N; and the friction of the runs, N.
    """

    pressure_pa: Array
    level_n: Array
    friction_n: float


@dataclass(frozen=True, eq=False)
class Expected:
    """Level of a further run at some pressures, as every model has it (models, pressures), N, its
    standard deviation, N, and the models' probabilities (models,).
    """

    mean_n: Array
    sd_n: Array
    probability: Array

    def overall_n(self) -> Array:
        """Mean over the models, N, (pressures,)."""
        return np.asarray(self.probability @ self.mean_n)

    def quantile_n(self, index: int, sign: float, share: float) -> float:
        """What the level times a sign exceeds but for a share of chance, at one pressure, N."""
        mean, sd = sign * self.mean_n[:, index], self.sd_n[:, index]

        def beyond(value: float) -> float:
            return float(self.probability @ norm.cdf((value - mean) / sd)) - share

        low, high = np.min(mean - FARTHEST_SD * sd), np.max(mean + FARTHEST_SD * sd)
        return float(brentq(beyond, low, high))


def expected(levels: Levels, pressures_pa: Array) -> Expected:
    """The level of a further run at pressures (n,) Pa."""
    models = [
        _by_model(levels, pressures_pa, own, departure)
        for own, departure in itertools.product(OWN, DEPARTURE)
    ]
    evidence = np.array([model[2] for model in models])
    probability = np.exp(evidence - evidence.max())
    return Expected(
        np.array([model[0] for model in models]),
        np.array([model[1] for model in models]),
        probability / probability.sum(),
    )


def safe_shifts_n(levels: Levels, pressures_pa: Sequence[float], room_n2: float) -> Array:
    """Shift of the level at each pressure, N, (pressures,): what is expected there, and beyond the
    runs' pressures no more than at their edge, but no more than RISK lets.

    `room_n2`: by how much the mean square of a run falls without any shift, N^2. With a shift c a
    run of level L errs less as long as (L - c)^2 < L^2 + room.
    """
    wanted = np.asarray(pressures_pa, dtype=np.float64)
    inside = np.clip(wanted, levels.pressure_pa.min(), levels.pressure_pa.max())
    found = expected(levels, wanted)
    there, at_edge = found.overall_n(), expected(levels, inside).overall_n()
    shifts = np.zeros(len(wanted))
    for index, mean in enumerate(there):
        sign = 1.0 if mean >= 0.0 else -1.0
        most = min(abs(mean), max(0.0, sign * at_edge[index]))
        least = found.quantile_n(index, sign, RISK)
        allowed = least + np.sqrt(least**2 + max(room_n2, 0.0))
        shifts[index] = sign * min(most, allowed)
    return shifts


def _by_model(
    levels: Levels, pressures_pa: Array, own: float, departure: float
) -> tuple[Array, Array, float]:
    """(mean, N; standard deviation, N, of a further run's level; log probability of the runs)."""
    mean_pa, friction = levels.pressure_pa.mean(), levels.friction_n
    seen = levels.pressure_pa / mean_pa - 1.0
    wanted = pressures_pa / mean_pa - 1.0

    def covariance(first: Array, second: Array) -> Array:
        apart = (first[:, None] - second[None]) / DEPARTURE_LENGTH
        trend = TREND_SD**2 * np.outer(first, second)
        return friction**2 * (CONSTANT**2 + trend + departure**2 * np.exp(-0.5 * apart**2))

    own_n2 = (own * friction) ** 2
    of_runs = covariance(seen, seen) + own_n2 * np.eye(len(seen))
    across = covariance(wanted, seen)
    about = levels.level_n - TREND * friction * seen
    by_runs = np.linalg.solve(of_runs, np.column_stack([about, across.T]))
    mean = TREND * friction * wanted + across @ by_runs[:, 0]
    of_wanted = np.diag(covariance(wanted, wanted)) + own_n2
    variance = of_wanted - np.einsum("ij,ji->i", across, by_runs[:, 1:])
    _, log_determinant = np.linalg.slogdet(of_runs)
    log_probability = -0.5 * (float(about @ by_runs[:, 0]) + float(log_determinant))
    return mean, np.sqrt(variance), log_probability
