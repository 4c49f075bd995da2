"""The sensors' own noise, and what an effect of a sensor takes off it.

What undoes a sensor's fault is a filter, and some filters damp the noise: a line that rings cuts a
band out of its pressure. The residual falls by that, though nothing is explained; so much is given
back before a hypothesis is judged.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from testbed.effects.active import Active
from testbed.estimation.leg.balance import corrected, piston_force_n

if TYPE_CHECKING:
    from testbed.diagnosis.leg.problem import Problem
    from testbed.diagnosis.leg.series import Series

Array = npt.NDArray[np.float64]


COARSE = 0.2
"""A channel that repeats its last value in this share of the samples steps by its resolution."""


def white_noise(values: Array) -> float:
    """Standard deviation of a channel's white noise, from second differences: robust, unless its
    steps are so coarse that most of them are zero.
    """
    second = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2])
    if grain(values) > 0.0:
        return float(np.sqrt(np.mean(second**2) / 6.0))
    return float(1.48 * np.median(second) / np.sqrt(6.0))


def grain(values: Array) -> float:
    """The step of a channel that is coarse beside its noise; 0 of any other."""
    steps = np.abs(np.diff(values))
    if np.mean(steps == 0.0) < COARSE or not steps.any():
        return 0.0
    return float(np.min(steps[steps > 1e-9 * np.max(np.abs(values))]))


def rounding_left(values: Array) -> float:
    """Standard deviation of what rounding leaves of a channel however long it is averaged: noise
    larger than half a step averages it out, less does not.

    The first harmonic of the rounding error dies as exp(-2 (pi sigma / step)^2) with the noise
    sigma before rounding (Widrow, Kollar: Quantization Noise, 2008).
    """
    step = grain(values)
    if step == 0.0:
        return 0.0
    sigma2 = max(white_noise(values) ** 2 - step**2 / 12.0, 0.0)
    return float(step / np.sqrt(12.0) * np.exp(-2.0 * np.pi**2 * sigma2 / step**2))


def given_back(problem: Problem, effects: Sequence[Active], force: Array) -> Array:
    """The stacked force residual (bins,), N, each recording's raised by the variance that the
    effects' filters take off the noise of its pressure sensors.
    """
    if not any(active.effect.overrides("correct") for active in effects):
        return force
    out, first = force.copy(), 0
    counted = problem.layout["force"].count > 0
    for series in problem.series:
        rows = slice(first, first + series.bins)
        first += series.bins
        left = force[rows][counted[rows]]
        if left.size:
            typical = max((1.48 * float(np.median(np.abs(left)))) ** 2, 1e-24)
            out[rows] *= np.sqrt(1.0 + _taken_off_n2(series, effects) / typical)
    return out


def _taken_off_n2(series: Series, effects: Sequence[Active]) -> float:
    """By how much less the pressures' noise varies in the force after each filter than before it,
    N2; what one raises makes up for nothing that another damps.
    """
    if series.pressure_noise_pa is None:
        return 0.0
    noise_a, noise_b = series.pressure_noise_pa
    noisy = series.signals.with_(pressure_a_pa=noise_a, pressure_b_pa=noise_b)
    still = series.signals.with_(
        pressure_a_pa=np.zeros_like(noise_a),
        pressure_b_pa=None if noise_b is None else np.zeros_like(noise_a),
    )
    mask = series.trusted & series.clear
    total, before = 0.0, _variance(*series.binned(piston_force_n(noisy), mask))
    for effect in effects:
        noisy, still = corrected(noisy, (effect,)), corrected(still, (effect,))
        after = _variance(*series.binned(piston_force_n(noisy) - piston_force_n(still), mask))
        total, before = total + max(before - after, 0.0), after
    return total


def _variance(mean: Array, count: Array) -> float:
    return float(np.mean(mean[count > 0] ** 2)) if (count > 0).any() else 0.0
