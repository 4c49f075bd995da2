"""What a set of names leaves as a line along the stroke: a force that comes again at equal steps of
the piston's way, as a rippled bore, rod or screw makes it, and that no name covers.

A line is sought among many wavelengths, so what it gains where it was found says little. Motions
that share it say more: with amplitude and phase from the others it has to predict each of them.
Presses on a load cell are left out, as what a sound landing leaves there has any shape.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.evidence import judged
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.search import Candidate

Array = npt.NDArray[np.float64]
WAVES_1_M = np.arange(8.0, 220.0)
"""Waves of the force along a metre of stroke that are tried: 4.6 to 125 mm long."""
CLIPPED_AT = 3.0
"""What is farther out, in standard deviations, is no ripple."""
LEAST_GAIN, LEAST_CARRIED, LEAST_MOTIONS = 100.0, 20.0, 2
"""Log-likelihood that a line gains in all, and that it gains with the others' amplitude in each of
so many motions. Rippled legs gain 146 and more and carry by 35 and more, sound ones gain at most
32 and carry by at most 13, legs with another effect gain at most 54: four, 28 and 38 simulated legs
of two simulators, on which these numbers were chosen.
"""


@dataclass(frozen=True)
class StrokeLine:
    """The line of the greatest gain: waves a metre, log-likelihood that it gains, and of that in
    each motion with the amplitude and phase that the other motions say.
    """

    waves_1_m: float
    gain: float
    carried: Mapping[str, float]

    @property
    def is_shared(self) -> bool:
        """Whether it is there, and not merely found."""
        motions = sum(value > LEAST_CARRIED for value in self.carried.values())
        return self.gain > LEAST_GAIN and motions >= LEAST_MOTIONS


@dataclass(frozen=True, eq=False)
class _Motion:
    """One motion's share in the normal equations of a line's cosine and sine, by wavelength:
    (waves, 2, 2) and (waves, 2), 1/N2 and 1/N.
    """

    name: str
    normal: Array
    right: Array


def stroke_line(problem: Problem, candidate: Candidate) -> StrokeLine | None:
    """The line that a set of names leaves in the force balances of motions in the air; None where
    fewer than two motions are.
    """
    motions = _motions(problem, candidate)
    if len(motions) < LEAST_MOTIONS:
        return None
    normal = sum((motion.normal for motion in motions), np.zeros((len(WAVES_1_M), 2, 2)))
    right = sum((motion.right for motion in motions), np.zeros((len(WAVES_1_M), 2)))
    gains = 0.5 * np.einsum("ki,ki->k", right, _solved(normal, right))
    best = int(np.argmax(gains))
    carried = {}
    for motion in motions:
        of_others = _solved(normal[best] - motion.normal[best], right[best] - motion.right[best])
        predicted = of_others @ (motion.right[best] - 0.5 * motion.normal[best] @ of_others)
        carried[motion.name] = float(predicted)
    return StrokeLine(float(WAVES_1_M[best]), float(gains[best]), carried)


def _motions(problem: Problem, candidate: Candidate) -> Sequence[_Motion]:
    layout, evidence = problem.layout["force"], candidate.evidence
    left = judged(problem, candidate.fit)["force"]
    out, first = [], 0
    for series in problem.series:
        rows = slice(first, first + series.bins)
        first += series.bins
        key = ("force", series.name)
        if not series.free or key not in evidence.scale:
            continue
        mine = layout.group[rows] == layout.names.index(key)
        counted = mine & (layout.count[rows] > 0)
        everywhere = np.ones(len(series.signals.position_m), dtype=bool)
        position_m = series.binned(series.signals.position_m, everywhere)[0][counted]
        noise_n = layout.relative[rows][counted] * evidence.scale[key]
        residual = np.clip(left[rows][counted] / noise_n, -CLIPPED_AT, CLIPPED_AT)
        out.append(_motion(series.name, position_m, residual, noise_n, evidence.memory[key]))
    return out


def _motion(
    name: str, position_m: Array, residual: Array, noise_n: Array, memory: float
) -> _Motion:
    """`residual` in standard deviations, which are `noise_n`; `memory`: so many bins count as
    one.
    """
    phase = 2.0 * np.pi * WAVES_1_M[:, None] * position_m
    waves = np.stack([np.cos(phase), np.sin(phase)], axis=1) / noise_n
    normal = np.einsum("kin,kjn->kij", waves, waves) / memory
    return _Motion(name, normal, waves @ residual / memory)


def _solved(normal: Array, right: Array) -> Array:
    """Cosine and sine (..., 2), N; next to nothing where they are next to nothing."""
    ridge = 1e-9 * np.abs(normal).mean() + np.finfo(float).tiny
    found: Array = np.linalg.solve(normal + ridge * np.eye(2), right[..., None])[..., 0]
    return found
