"""How much better a hypothesis predicts blocks that it was not fitted on, in units of
log-likelihood.

Each group (a channel of one recording) has noise of unknown size, heavy tails and a memory: its
likelihood is Student's with the scale profiled out, divided by the residual's correlation time, so
that a thousand correlated samples do not count as a thousand witnesses.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.noise import flow_given_back, given_back
from testbed.diagnosis.leg.prediction import held_out
from testbed.diagnosis.leg.problem import Problem

Array = npt.NDArray[np.float64]
FREEDOM = 4.0
"""Degrees of freedom of the tails."""
FEWEST = 30
"""Fewer bins than this do not tell the noise of a group."""
Key = tuple[str, str]


@dataclass(frozen=True)
class Evidence:
    """Per group: log-likelihood of the held-out residual, its scale, root mean square and
    correlation time (bins).
    """

    log_likelihood: dict[Key, float]
    scale: dict[Key, float]
    rms: dict[Key, float]
    memory: dict[Key, float]
    count: dict[Key, int]

    def gain_over(self, other: Evidence, memory: Evidence) -> float:
        """Log-likelihood gained over `other`; correlation times are those of `memory` (the best
        description).
        """
        return sum(
            (value - other.log_likelihood[key]) / memory.memory[key]
            for key, value in self.log_likelihood.items()
        )

    def parts(self, other: Evidence, memory: Evidence) -> dict[Key, float]:
        """Log-likelihood gained over `other` in each group of bins."""
        return {
            name: (value - other.log_likelihood[name]) / memory.memory[name]
            for name, value in self.log_likelihood.items()
        }

    def largest_fall(self, other: Evidence, unsure: Mapping[str, float] | None = None) -> float:
        """Largest relative fall of a group's scale against `other`, 0..1; groups at rest do not
        count.

        `unsure`: channel -> how uncertain what it is compared with is; that is no fault of any
        model.
        """
        least = unsure or {}
        falls = [
            1.0
            - np.hypot(self.scale[key], least.get(key[0], 0.0))
            / np.hypot(other.scale[key], least.get(key[0], 0.0))
            for key in self.scale
            if not key[0].endswith("rest")
        ]
        return float(max(falls, default=0.0))


def evidence(problem: Problem, fit: Fit) -> Evidence:
    """Evidence of a fit from what it leaves of bins that it was not fitted on."""
    return of_residual(problem, judged(problem, fit))


def judged(problem: Problem, fit: Fit) -> dict[str, Array]:
    """Held-out residuals by which a fit is judged: noise that its effects only filter is put
    back.
    """
    left = held_out(problem, fit)
    out = left | {"force": given_back(problem, fit.at.effects, left["force"])}
    if "flow" in left:
        out["flow"] = flow_given_back(problem, fit.at.effects, left["flow"])
    return out


def of_residual(problem: Problem, residual: dict[str, Array]) -> Evidence:
    """Evidence of given (held-out) residuals."""
    out = Evidence({}, {}, {}, {}, {})
    for channel, values in residual.items():
        layout = problem.layout[channel]
        for number, key in enumerate(layout.names):
            here = (layout.group == number) & (layout.count > 0)
            if here.sum() < FEWEST:
                continue
            scaled = values[here] / layout.relative[here]
            scale, value = student(scaled)
            out.log_likelihood[key], out.scale[key] = value, scale
            clipped = np.clip(values[here], -8.0 * scale, 8.0 * scale)
            out.rms[key] = float(np.sqrt(np.mean(clipped**2)))
            out.memory[key] = correlation_time(np.clip(scaled / scale, -3.0, 3.0))
            out.count[key] = int(here.sum())
    return out


def student(r: Array) -> tuple[float, float]:
    """(scale, log-likelihood) of Student's distribution about 0, scale by maximum likelihood."""
    square = r * r
    variance = max(float(np.median(square)) / 0.55, 1e-24)
    for _ in range(12):
        variance = max(
            float(np.mean((FREEDOM + 1.0) * square / (FREEDOM + square / variance))), 1e-24
        )
    tail = 0.5 * (FREEDOM + 1.0) * np.log1p(square / (FREEDOM * variance))
    return float(np.sqrt(variance)), float(-0.5 * len(r) * np.log(variance) - tail.sum())


def correlation_time(values: Array) -> float:
    """Integrated autocorrelation time in samples, at least 1 (Sokal's window)."""
    count = len(values)
    power = np.abs(np.fft.rfft(values, 2 * count)) ** 2
    correlation = np.fft.irfft(power)[:count]
    if correlation[0] <= 0.0:
        return 1.0
    summed = 1.0 + 2.0 * np.cumsum(correlation[1:] / correlation[0])
    window = np.arange(1, count) >= 5.0 * summed
    at = int(np.argmax(window)) if window.any() else count - 2
    return max(1.0, float(summed[at]))
