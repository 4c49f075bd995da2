"""All scalar filters by name: the published two, further rivals from the literature, and the
testbed's own.

Each of the further ones is a Kalman filter with another way to meet outliers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.estimation.filters import kbf, modified_kbf, persistent
from testbed.estimation.filters.base import Run, over
from testbed.estimation.filters.kbf import KalmanState, only_predict, predict_and_update, start
from testbed.formats.arrays import Array
from testbed.formats.records import quantity

ITERATIONS = 5
"""Variational updates of a sample by `student_t_step`."""


class ChiSquare(kbf.Numbers):
    """Of the filter with a gate on the innovation."""

    limit = quantity("1", "of e^2 / (P + Q + R); 6.63 passes 99 % of what the model expects")


class Huber(kbf.Numbers):
    """Of the filter with Huber's weight."""

    corner = quantity(
        "1", "c: standard deviations up to which a sample counts in full; usually 1.345"
    )


class Saturated(kbf.Numbers):
    """Of the filter whose innovation is cut off."""

    limit = quantity("N", "an innovation pulls no more than this one")


class StudentT(kbf.Numbers):
    """Of the filter for Student-t noise."""

    freedom = quantity("1", "nu: degrees of freedom of the noise; 4 is common")


@njit
def chi_square_step(state: Any, z: float, numbers: Any) -> float:
    """One sample, used only if e^2 / (P + Q + R) <= limit.

    The gate widens as P grows, by Q a sample: for a step of several kN and the Q of a smooth filter
    that takes minutes.
    """
    q, r = numbers.process_variance, numbers.measurement_variance
    if state.started == 0.0:
        return float(start(state, z, r))
    error = z - state.value
    if not np.isfinite(z) or error * error > numbers.limit * (state.variance + q + r):
        return float(only_predict(state, q))
    return float(predict_and_update(state, z, q, r))


@njit
def huber_step(state: Any, z: float, numbers: Any) -> float:
    """One sample; beyond c standard deviations an innovation pulls linearly less: R is replaced by
    R |r| / c where |r| = |e| / sqrt(P + Q + R) > c.
    """
    q, r = numbers.process_variance, numbers.measurement_variance
    if state.started == 0.0:
        return float(start(state, z, r))
    if not np.isfinite(z):
        return float(only_predict(state, q))
    deviations = abs(z - state.value) / math.sqrt(state.variance + q + r)
    return float(predict_and_update(state, z, q, r * max(1.0, deviations / numbers.corner)))


@njit
def saturated_step(state: Any, z: float, numbers: Any) -> float:
    """One sample; a far one pulls, but no more than one at the limit."""
    q, r = numbers.process_variance, numbers.measurement_variance
    if state.started == 0.0:
        return float(start(state, z, r))
    if not np.isfinite(z):
        return float(only_predict(state, q))
    error = min(max(z - state.value, -numbers.limit), numbers.limit)
    return float(predict_and_update(state, state.value + error, q, r))


@njit
def student_t_step(state: Any, z: float, numbers: Any) -> float:
    """One sample, its noise's scale found by variational updates.

    Repeat: R_k = R (nu + (e^2 + P_k) / R) / (nu + 1), e = z - x_k; update (x_k, P_k) from the prior
    with R_k.
    """
    q, r = numbers.process_variance, numbers.measurement_variance
    if state.started == 0.0:
        return float(start(state, z, r))
    if not np.isfinite(z):
        return float(only_predict(state, q))
    prior, nu = state.variance + q, numbers.freedom
    x, variance = state.value, prior
    for _ in range(ITERATIONS):
        noise = r * (nu + ((z - x) ** 2 + variance) / r) / (nu + 1.0)
        gain = prior / (prior + noise)
        x, variance = state.value + gain * (z - state.value), (1.0 - gain) * prior
    state.value, state.variance = x, variance
    return float(x)


@dataclass(frozen=True)
class Filter:
    """A filter as it is compared: `constant` is the one of its own that it may choose, from
    `values`.
    """

    name: str
    run: Run
    constant: str = ""
    values: tuple[float, ...] = ()
    fixed: tuple[tuple[str, float], ...] = ()
    """Further constants, by name."""

    @property
    def choices(self) -> tuple[dict[str, float], ...]:
        """The constants that it may choose from, by name; the usual ones first."""
        rest = dict(self.fixed)
        return tuple({self.constant: value} | rest for value in self.values) or (rest,)

    def __call__(
        self,
        z_n: Array,
        q_n2: float,
        r_n2: float,
        constants: dict[str, float] | None = None,
    ) -> Array:
        """Filter z[n] in N with this Q and R and one of its choices (the first one where none is
        given).
        """
        chosen = self.choices[0] if constants is None else constants
        return self.run(z_n, process_variance=q_n2, measurement_variance=r_n2, **chosen)


RIVALS: tuple[Filter, ...] = (
    Filter("kf", kbf.run),
    Filter("modified_kbf", modified_kbf.run, "innovation_limit", (300.0, 180.0, 240.0, 600.0)),
    Filter(
        "chi_square",
        over(chi_square_step, KalmanState, ChiSquare),
        "limit",
        (6.63, 3.84, 10.83, 25.0),
    ),
    Filter("huber", over(huber_step, KalmanState, Huber), "corner", (1.345, 0.7, 2.0, 3.0)),
    Filter(
        "saturated",
        over(saturated_step, KalmanState, Saturated),
        "limit",
        (300.0, 90.0, 180.0, 600.0),
    ),
    Filter(
        "student_t", over(student_t_step, KalmanState, StudentT), "freedom", (4.0, 2.0, 8.0, 30.0)
    ),
)
OWN = Filter("own", persistent.run, "innovation_limit", (300.0,), (("hold_samples", 10.0),))
