"""The correction of a bench each of whose runs holds one pressure, as seals are measured.

Two things are learnt apart. The course of the friction along a stroke is the same in every run, and
what one run shows of it holds for the others: generic terms that say something within a run of one
speed, by ridge regression about each run's means out and back, shrunk as much as runs left out do
not speak against (the one-standard-error rule of Breiman et al. 1984). The level of the friction
differs from run to run: it is shifted with the pressure as far as that is safe
(pressure_level.py).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.left_over import Folds, LeftOver
from testbed.diagnosis.leg.pressure_level import Levels, safe_shifts_n
from testbed.effects.unnamed import AT_PRESSURES

Array = npt.NDArray[np.float64]
HELD = 0.2
"""A run holds its pressure that wanders by less than this share of what the runs' pressures differ
by, standard deviations."""
RIDGES = (1e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0)
"""Weight of the squared weights of terms of unit size, relative to the mean squared residual's."""
OF_SPEED = (
    "velocity",
    "velocity_2",
    "speed",
    "velocity_position",
    "sliding_10_mm_s",
    "sliding_20_mm_s",
    "pressure_sliding_10_mm_s",
    "pressure_sliding_20_mm_s",
)
"""Terms that runs of one speed hardly show, and that move the level of a run of another speed."""
INDEPENDENT = 1e-3
"""Smallest singular value of the terms' levels that counts, relative to the largest."""


def holds_pressures(left: Sequence[LeftOver]) -> bool:
    """Whether each run holds one pressure, and they differ."""
    between = float(np.std([run.pressure_pa for run in left]))
    within = max(run.pressure_sd_pa for run in left)
    return within < HELD * between and all(run.goes_both_ways for run in left)


def held_pressure_weights(
    left: Sequence[LeftOver], folds: Folds, names: Sequence[str], pressures_pa: tuple[float, float]
) -> dict[str, float]:
    """Term -> weight, N, of the correction; none where nothing can be learnt.

    `folds`: what others leave, and what the run that is left out does. `pressures_pa`: lowest and
    highest that the correction is fitted on.
    """
    used = np.array([name not in OF_SPEED for name in names], dtype=np.float64)
    ridge, shares = _shrunk_by(folds, used)
    found: dict[str, float] = {}
    room_n2 = 0.0
    if shares.max() < 1.0:
        weights, bias = _course_weights(left, ridge, used)
        found = dict(zip(names, weights, strict=True)) | {"bias": bias}
        room_n2 = (1.0 - shares.max()) * float(np.mean([_course_n2(run) for run in left]))
    lowest, highest = pressures_pa
    wanted = [lowest + way * (highest - lowest) for way in AT_PRESSURES.values()]
    shifts_n = safe_shifts_n(_levels(left), wanted, room_n2) / _slides(left)
    if np.any(shifts_n):
        found |= dict(zip(AT_PRESSURES, map(float, shifts_n), strict=True))
    return found


def _levels(left: Sequence[LeftOver]) -> Levels:
    return Levels(
        np.array([run.pressure_pa for run in left]),
        np.array([float(run.level(run.residual_n)) for run in left]),
        float(np.mean([run.friction_n for run in left])),
    )


def _slides(left: Sequence[LeftOver]) -> float:
    """Level of a friction of 1 N that has its sign from the motion, mean over the runs."""
    levels = [run.level(run.columns[:, run.level_terms[0]]) for run in left]
    return float(np.mean(np.abs(levels)))


def _course_n2(run: LeftOver) -> float:
    return float(np.mean(run.course(run.residual_n) ** 2))


def _shrunk_by(folds: Folds, used: Array) -> tuple[float, Array]:
    """(ridge, what is left of each run left out): the largest ridge whose mean is within a standard
    error of the least. A correction that moves the level or the zero of a run left out has that
    counted as left, whichever way.
    """
    shares = np.array([[_left_share(fold, ridge, used) for fold in folds] for ridge in RIDGES])
    mean = shares.mean(axis=1)
    best = int(np.argmin(mean))
    error = shares[best].std() / np.sqrt(shares.shape[1])
    chosen = max(index for index, value in enumerate(mean) if value <= mean[best] + error)
    return RIDGES[chosen], shares[chosen]


def _left_share(fold: tuple[list[LeftOver], LeftOver], ridge: float, used: Array) -> float:
    others, test = fold
    weights, bias = _course_weights(others, ridge, used)
    correction = bias + test.columns @ weights
    course = test.course(test.residual_n - correction)
    moved = float(test.level(correction)) ** 2 + test.zero(correction) ** 2
    return (float(np.mean(course**2)) + moved) / _course_n2(test)


def _course_weights(left: Sequence[LeftOver], ridge: float, used: Array) -> tuple[Array, float]:
    """(weights of the terms, constant), N: of the course, with neither level nor zero."""
    spread = np.vstack([run.columns - run.columns.mean(axis=0) for run in left])
    size = np.maximum(np.sqrt(np.mean(spread**2, axis=0)), 1e-12)
    unit = np.vstack([run.course(run.columns) for run in left]) / size * used
    residual = np.concatenate([run.course(run.residual_n) for run in left])
    normal = unit.T @ unit / len(unit) + ridge * np.eye(len(size))
    weights = used * np.linalg.solve(normal, unit.T @ residual / len(unit)) / size
    of_terms = np.array([run.level(run.columns) for run in left])
    terms = list(left[0].level_terms)
    levelled = np.linalg.lstsq(of_terms[:, terms], -of_terms @ weights, rcond=INDEPENDENT)
    weights[terms] += levelled[0]
    return weights, -float(np.mean([run.zero(run.columns @ weights) for run in left]))
