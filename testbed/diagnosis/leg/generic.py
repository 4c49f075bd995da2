"""A generic correction for what has no name: kept only where it carries over to motions that it was
not fitted on.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from testbed.diagnosis.leg.evidence import of_residual
from testbed.diagnosis.leg.fit import Fit, solve
from testbed.diagnosis.leg.points import restarted
from testbed.diagnosis.leg.prediction import held_out
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.unexplained import generic_names
from testbed.effects.unnamed import UNNAMED

SIZES_N = (10.0, 40.0, 160.0)
"""Standard deviations of the terms' weights before the data: the smaller, the more is shrunk."""
LEAST, MOST_WORSE = 0.03, 0.01
"""What recordings left out must gain in the mean, and what none of them may lose, of the residual's
scale.
"""


def correction(problem: Problem, refit: Fit) -> Fit | None:
    """The refit with generic terms, shrunk so that each recording is predicted best from the
    others; None if no size of shrinking predicts them better.
    """
    before = _by_recording(problem, refit)
    best: tuple[float, Fit] | None = None
    for size in SIZES_N:
        fit = _shrunk(problem, refit, size)
        after = _by_recording(problem, fit)
        change = np.array([np.log(after[key] / before[key]) for key in before])
        if (
            change.mean() < -LEAST
            and change.max() < MOST_WORSE
            and (best is None or change.mean() < best[0])
        ):
            best = (float(change.mean()), fit)
    return best[1] if best else None


def _shrunk(problem: Problem, refit: Fit, size_n: float) -> Fit:
    coordinates = [restarted(coordinate, refit.at) for coordinate in refit.coordinates]
    for c in UNNAMED.coordinates(shapes=generic_names(problem)):
        coordinates.append(replace(c, prior=(0.0, size_n / np.sqrt(_memory(problem, refit)))))
    effects = (*refit.at.effects, UNNAMED.active())
    return solve(problem, coordinates, replace(refit.at, effects=effects), 5, refit.scale)


def _memory(problem: Problem, fit: Fit) -> float:
    """Samples that count as one: the prior has to weigh as much as it would against independent
    ones.
    """
    found = of_residual(problem, fit.residual)
    return float(
        np.median([value for name, value in found.memory.items() if name[0] == "force"] or [1.0])
    )


def _by_recording(problem: Problem, fit: Fit) -> dict[str, float]:
    """Recording -> scale of its force residual as predicted from the other recordings, N."""
    found = of_residual(problem, {"force": held_out(problem, fit, by_recording=True)["force"]})
    return {
        recording: scale
        for (channel, recording), scale in found.scale.items()
        if channel == "force"
    }
