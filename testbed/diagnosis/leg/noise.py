"""The sensors' own noise, and what an effect of a sensor takes off it.

What undoes a sensor's fault is a filter, and some filters damp the noise: a line that rings cuts a
band out of its pressure. The residual falls by that, though nothing is explained; so much is given
back before a hypothesis is judged.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from testbed.effects.active import Active
from testbed.effects.terms import Signals
from testbed.estimation.leg.balance import corrected, piston_force_n
from testbed.estimation.leg.motion import slope

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
    return _raised(problem, effects, "force", force)


def flow_given_back(problem: Problem, effects: Sequence[Active], flow: Array) -> Array:
    """The stacked flow residual, m3/s, each recording's of A, then of B, raised as `given_back`
    does the force residual.
    """
    return _raised(problem, effects, "flow", flow)


def _raised(problem: Problem, effects: Sequence[Active], channel: str, residual: Array) -> Array:
    filters = [active for active in effects if active.effect.overrides("correct")]
    if not filters:
        return residual
    out, first = residual.copy(), 0
    counted = problem.layout[channel].count > 0
    for series in problem.series:
        for taken in _taken_off(series, filters, NOISY[channel]):
            rows = slice(first, first + series.bins)
            first += series.bins
            left = residual[rows][counted[rows]]
            if left.size:
                typical = max((1.48 * float(np.median(np.abs(left)))) ** 2, LEAST[channel])
                out[rows] *= np.sqrt(1.0 + taken / typical)
    return out


LEAST = {"force": 1e-24, "flow": 1e-30}
"""Variance of a residual below which it is none, N2 and m6/s2."""


def _taken_off(
    series: Series, filters: Sequence[Active], noisy: Callable[[Signals], tuple[Array, ...]]
) -> list[float]:
    """By how much less the pressures' noise varies after each filter than before it, in each of
    the balances that `noisy` makes of it; what one raises makes up for nothing that another damps.
    """
    if series.pressure_noise_pa is None:
        return [0.0] * len(noisy(series.signals))
    noise_a, noise_b = series.pressure_noise_pa
    read = series.signals.with_(pressure_a_pa=noise_a, pressure_b_pa=noise_b)
    still = series.signals.with_(
        pressure_a_pa=np.zeros_like(noise_a),
        pressure_b_pa=None if noise_b is None else np.zeros_like(noise_a),
    )
    mask = series.trusted & series.clear

    def varies() -> Array:
        pairs = zip(noisy(read), noisy(still), strict=True)
        return np.array(
            [_variance(*series.binned(with_ - without, mask)) for with_, without in pairs]
        )

    before = varies()
    total = np.zeros_like(before)
    for effect in filters:
        read, still = corrected(read, (effect,)), corrected(still, (effect,))
        after = varies()
        total, before = total + np.maximum(before - after, 0.0), after
    return [float(taken) for taken in total]


def _in_force(signals: Signals) -> tuple[Array, ...]:
    """Force that pressures make on the piston, N, (n,)."""
    return (piston_force_n(signals),)


def _in_flow(signals: Signals) -> tuple[Array, ...]:
    """Flow that presses the oil of A and B, m3/s, each (n,)."""
    volumes = chamber_volumes_m3(signals)
    softness = 1.0 / (signals.known.bulk_modulus_pa or 1e9)
    out = []
    for volume, pressure in zip(
        volumes, (signals.pressure_a_pa, signals.pressure_b_pa), strict=True
    ):
        assert pressure is not None
        out.append(softness * volume * slope(pressure, signals.rate_hz))
    return tuple(out)


NOISY: Mapping[str, Callable[[Signals], tuple[Array, ...]]] = {
    "force": _in_force,
    "flow": _in_flow,
}


def chamber_volumes_m3(signals: Signals) -> tuple[Array, Array]:
    """Oil in A and B, m3, each (n,)."""
    known, position = signals.known, signals.position_m
    dead_a, dead_b = known.dead_volume_a_m3 or 0.0, known.dead_volume_b_m3 or 0.0
    left = (known.stroke_m or 0.0) - position
    return dead_a + known.area_a_m2 * position, dead_b + known.area_b_m2 * left


def _variance(mean: Array, count: Array) -> float:
    return float(np.mean(mean[count > 0] ** 2)) if (count > 0).any() else 0.0
