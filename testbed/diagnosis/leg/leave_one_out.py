"""Prediction of whole recordings that nothing was fitted on: each of `identify` is left out in
turn, and all refitted.

Folds of blocks share their motion with what they are predicted from; a recording of another level
or another motion does not. A rig with one recording is cut into QUARTERS of its time.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from testbed.diagnosis.leg.evidence import of_residual
from testbed.diagnosis.leg.fit import Fit, solve
from testbed.diagnosis.leg.noise import given_back
from testbed.diagnosis.leg.points import Point, restarted
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import Series, series_of
from testbed.diagnosis.leg.verification import force_residual, moving, rms
from testbed.effects.active import Active
from testbed.estimation.friction.identification import identify
from testbed.recording.axis import Recording
from testbed.recording.leg_model import LegModel

QUARTERS = 4
ITERATIONS = 12
RunErrors = Mapping[Any, float]
"""Recording left out -> root mean square of its force residual, N, single outliers clipped."""


def runs_of(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """The recordings that are left out in turn: those there are, or the quarters of the only
    one.
    """
    if len(recordings) > 1:
        return tuple(recordings)
    (whole,) = recordings
    ends = np.linspace(0, len(whole), QUARTERS + 1).astype(int)
    pairs = itertools.pairwise(ends)
    return tuple(
        whole.part(slice(start, stop), f"quarter {index + 1}")
        for index, (start, stop) in enumerate(pairs)
    )


@dataclass(frozen=True, eq=False)
class Runs:
    """The recordings of a problem, each of which can be left out."""

    problem: Problem
    recordings: tuple[Recording, ...]
    series: tuple[Series, ...]

    @classmethod
    def of(cls, problem: Problem, recordings: Sequence[Recording]) -> Runs:
        """The runs of the recordings that a problem was made of."""
        runs = runs_of(recordings)
        return cls(problem, runs, series_of(runs, problem.base.known))

    def errors(self, fit: Fit, as_written: bool = False) -> RunErrors:
        """Every run as predicted by the fit's form, refitted on the other runs; `as_written`: by
        the model that is written of it, which has no effect but those that are believed.
        """
        out = {}
        for index, left_out in enumerate(self.series):
            at = self._fitted_without(index, fit)
            effects = self.problem.believed if as_written else at.effects
            out[left_out.name] = self._error(left_out, at.model(self.problem.base), effects)
        return out

    def estimates(self, fit: Fit) -> tuple[RunErrors, RunErrors]:
        """Every run's error of the estimated force where the piston moves, N, root mean square: by
        the model that is written of the fit, refitted on the other runs, and by the one that
        `identify` makes of these. Slow motion beside reversals counts in it, where no fit looks.
        """
        by_fit, by_identified = {}, {}
        for index, (recording, series) in enumerate(zip(self.recordings, self.series, strict=True)):
            fitted = self._fitted_without(index, fit).model(self.problem.base)
            by_fit[series.name] = moving_error_n(recording, fitted)
            identified = self.identified_without(index)
            by_identified[series.name] = moving_error_n(recording, identified)
        return by_fit, by_identified

    def _fitted_without(self, run: int, fit: Fit) -> Point:
        """Where a fit of this form ends on all runs but the k-th."""
        others = self._problem(*self.series[:run], *self.series[run + 1 :])
        coordinates = [restarted(coordinate, fit.at) for coordinate in fit.coordinates]
        return solve(others, coordinates, fit.at, ITERATIONS).at

    def identified(self) -> RunErrors:
        """Every run as predicted by the published model that `identify` makes of the other runs."""
        out = {}
        for index, left_out in enumerate(self.series):
            model = self.identified_without(index)
            out[left_out.name] = self._error(left_out, model, self.problem.believed)
        return out

    def identified_without(self, run: int) -> LegModel:
        """The published model that `identify` makes of all runs but the k-th."""
        others = [*self.recordings[:run], *self.recordings[run + 1 :]]
        free = [other for other in others if other.is_free] or others
        return identify(free, self.recordings[run].known, self.problem.base.rig).model

    def _problem(self, *series: Series) -> Problem:
        return Problem(series, self.problem.base, self.problem.with_flow, self.problem.believed)

    def _error(self, series: Series, model: LegModel, effects: Sequence[Active]) -> float:
        judged = self._problem(series)
        residual = given_back(judged, effects, judged.force(model, effects))
        found = of_residual(judged, {"force": residual}).rms
        if found:
            return next(iter(found.values()))
        counted = residual[judged.layout["force"].count > 0]
        return float(np.sqrt(np.mean(counted**2))) if counted.size else 0.0


def moving_error_n(recording: Recording, model: LegModel) -> float:
    """Error of a model's estimated force where the piston moves, N: what a diagnosis is judged
    by.
    """
    return rms(force_residual(recording, model)[moving(recording, model)])


def overall(errors: RunErrors) -> float:
    """Root mean square over the runs, N: each counts alike."""
    return float(np.sqrt(np.mean(np.square(list(errors.values())))))


def worst_ratio(errors: RunErrors, against: RunErrors) -> float:
    """Largest error of a run relative to the same run's in `against`."""
    return max(error / max(against[run], 1e-12) for run, error in errors.items())
