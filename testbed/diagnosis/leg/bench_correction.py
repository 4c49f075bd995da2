"""What a bench or a drive shows beyond its identified model and beyond every name, as a correction
without a cause.

Linear in its weights, and fitted to what `identify` leaves about the mean of each run: a bench's
zero wanders from run to run, so its level is left to `identify`. How much the weights are shrunk is
what predicts runs left out best. A correction that carries over to other runs may still fail on
other motions: there is one only where it helps every run left out, and all of them together much.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.leave_one_out import RunErrors, Runs, overall, worst_ratio
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import Series
from testbed.effects.unnamed import UNNAMED, basis, friction_shapes
from testbed.recording.axis import Recording
from testbed.recording.leg_model import EffectEntry, LegModel, Parameter

Array = npt.NDArray[np.float64]
RIDGES = (1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3)
"""Weight of the squared weights of terms of unit size, relative to the mean squared residual's."""
BETTER, MUCH = 0.97, 0.8
"""Shares of `identify`'s error to which every run left out, and all of them together, must come
down. Chosen on measured seals, one drive, and simulated drives with other laws and other motions.
"""
LEVELS = ("bias", "pressure_a", "pressure_a_2", "pressure_b", "pressure_b_2")
"""Generic terms that say nothing within a run of one pressure."""


@dataclass(frozen=True, eq=False)
class _Left:
    """What a model leaves of one run: residual (bins,) N, and the terms' columns (bins, terms)."""

    run: str
    residual_n: Array
    columns: Array

    def error_n(self, weights: Array, bias: float) -> float:
        """Root mean square with these weights of the terms, and this constant."""
        return float(np.sqrt(np.mean((self.residual_n - bias - self.columns @ weights) ** 2)))


def bench_correction(
    problem: Problem, recordings: Sequence[Recording], identified: LegModel
) -> LegModel | None:
    """The identified model with its correction, or None where none carries over to runs that it was
    not fitted on.
    """
    runs = Runs.of(problem, recordings)
    folds = _folds(runs)
    none = np.zeros(len(_terms(runs.series[0])))
    before = {test.run: test.error_n(none, 0.0) for _, test in folds}
    best, ridge = np.inf, None
    for option in RIDGES:
        after = {test.run: test.error_n(*_weights(others, option)) for others, test in folds}
        if overall(after) < best and _carries_over(after, before):
            best, ridge = overall(after), option
    if ridge is None:
        return None
    weights, bias = _weights(_left(runs.series, identified, problem), ridge)
    found = dict(zip(_terms(runs.series[0]), weights, strict=True)) | {"bias": bias}
    parameters = {name: Parameter(value=float(weight), unit="N") for name, weight in found.items()}
    # What goes along the stroke is in shares of the one that it was fitted with.
    known = identified.known.model_copy(update={"stroke_m": problem.base.known.stroke_m})
    entry = EffectEntry(name=UNNAMED.kind, parameters=parameters)
    return identified.model_copy(update={"known": known, "effects": (entry,)})


def _carries_over(after: RunErrors, before: RunErrors) -> bool:
    return worst_ratio(after, before) < BETTER and overall(after) < MUCH * overall(before)


def _terms(series: Series) -> dict[str, Array]:
    generic = {name: value for name, value in basis(series.signals).items() if name not in LEVELS}
    return generic | friction_shapes(series.signals)


def _left(series: Sequence[Series], model: LegModel, problem: Problem) -> list[_Left]:
    out = []
    for s in series:
        judged = Problem((s,), problem.base, problem.with_flow)
        counted = judged.layout["force"].count > 0
        mask = s.trusted & s.clear
        columns = [s.binned(values, mask)[0][counted] for values in _terms(s).values()]
        residual_n = judged.force(model, ())[counted] / judged.as_read(model, ())
        out.append(_Left(s.name, residual_n, np.column_stack(columns)))
    return [left for left in out if left.residual_n.size]


def _folds(runs: Runs) -> list[tuple[list[_Left], _Left]]:
    """For each run: (what the model identified on the others leaves of these, and of this one)."""
    out = []
    for index, test in enumerate(runs.series):
        model = runs.identified_without(index)
        found = _left((test,), model, runs.problem)
        others = _left((*runs.series[:index], *runs.series[index + 1 :]), model, runs.problem)
        if found and others:
            out.append((others, found[0]))
    return out


def _weights(left: Sequence[_Left], ridge: float) -> tuple[Array, float]:
    """(weights of the terms, constant that keeps the mean of all), N: ridge regression about each
    run's mean.
    """
    columns = np.vstack([run.columns - run.columns.mean(axis=0) for run in left])
    residual = np.concatenate([run.residual_n - run.residual_n.mean() for run in left])
    size = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-12)
    unit = columns / size
    normal = unit.T @ unit / len(unit) + ridge * np.eye(len(size))
    weights = np.linalg.solve(normal, unit.T @ residual / len(unit)) / size
    return weights, -float(np.mean(np.vstack([run.columns for run in left]) @ weights))
