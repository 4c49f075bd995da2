"""What a bench or a drive shows beyond its identified model and beyond every name, as a correction
without a cause.

Linear in its weights, and fitted to what `identify` leaves of each run about its means out and
back: a bench's zero wanders from run to run, and so does the level of its friction
(run_variation.WANDER). What is learnt so is the course of the friction along a stroke. Its level is
left to `identify`, or goes straight with the runs' pressures, by as much as the runs differ by more
than repeats of one run do. Where that carries over to no run, the level is fitted with all else,
about each run's mean, which has to help much more. Beyond the pressures, speeds, places and
temperatures that it was fitted on, a correction stays as it is at their edge.

How much the weights are shrunk is what predicts runs left out best. A correction that carries over
to other runs may still fail on other motions: there is one only where it helps every run left out,
and all of them together much.

Where each run holds one pressure, as seals are measured, held_pressures.py makes the correction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.held_pressures import held_pressure_weights, holds_pressures
from testbed.diagnosis.leg.leave_one_out import RunErrors, Runs, overall, worst_ratio
from testbed.diagnosis.leg.left_over import (
    LEVEL_TERMS,
    Folds,
    LeftOver,
    folds_of,
    left_over,
    term_names,
)
from testbed.diagnosis.leg.model_form_error import FRICTION_FORM_OF_BENCHES
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.run_variation import WANDER
from testbed.effects.unnamed import EDGES, UNNAMED, edge_unit, edges_of
from testbed.recording.axis import Recording
from testbed.recording.leg_model import EffectEntry, LegModel, Parameter

Array = npt.NDArray[np.float64]
RIDGES = (1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3)
"""Weight of the squared weights of terms of unit size, relative to the mean squared residual's."""
BETTER = 0.97
MUCH = {"trend": 0.9, "identified": 0.95, "fitted": 0.8}
"""Shares of `identify`'s error to which every run left out, and all of them together by how their
level is found, must come down. The first and the last were chosen on measured seals, one drive, and
simulated drives with other laws and other motions, the others on 44 simulated seals and after
seeing which training runs of three measured seals they refused."""
LEAST_KEPT = 0.75
"""Share of a trend with the pressure that has to be kept: one of twice what friction wanders by."""
HALF = 0.5
"""Share of `identify`'s error to which a correction brings every run left out only where a law is
missing. Of 35 sound benches and drives of two simulators it brings the run that it helps least to
0.73 at best, of 11 with bristles of many stiffnesses or a backlash to 0.09 to 0.37."""
LEAST_MISSING = 2.0 * FRICTION_FORM_OF_BENCHES
"""Share of the friction below which nothing is missing: twice what formulas are true to."""
ALIKE = 1e-3
"""Pressures of runs that differ by less than this share say nothing of a trend."""


@dataclass(frozen=True)
class _Form:
    """How a correction is fitted: what its level is, and how much it is shrunk.

    `level`: `trend`, the runs' mean and their trend with the pressure; `identified`, that of
    `identify`; `fitted`, with all else, run by run.
    """

    level: str
    ridge: float


FORMS = (
    tuple(_Form(level, ridge) for level in ("trend", "identified") for ridge in RIDGES),
    tuple(_Form("fitted", ridge) for ridge in RIDGES),
)
"""Those that are tried first, and those where none of these carries over."""


def bench_correction(
    problem: Problem, recordings: Sequence[Recording], identified: LegModel
) -> LegModel | None:
    """The identified model with its correction, or None where none carries over to runs that it was
    not fitted on.
    """
    runs = Runs.of(problem, recordings)
    names = term_names(runs.series)
    folds = folds_of(runs, names)
    edges = edges_of(series.signals for series in runs.series)
    left = left_over(runs.series, identified, problem, names, edges)
    found: dict[str, float] = {}
    if folds and holds_pressures(left):
        low, high = EDGES["pressure_a_pa"]
        found = held_pressure_weights(left, folds, names, (edges[low], edges[high]))
    elif (form := _best_form(folds, names)) is not None:
        weights, bias = _weights(left, form)
        found = dict(zip(names, weights, strict=True)) | {"bias": bias}
    if not found:
        return None
    parameters = {name: Parameter(value=float(weight), unit="N") for name, weight in found.items()}
    for name, value in edges.items():
        parameters[name] = Parameter(value=value, unit=edge_unit(name))
    # What goes along the stroke is in shares of the one that it was fitted with.
    known = identified.known.model_copy(update={"stroke_m": problem.base.known.stroke_m})
    entry = EffectEntry(name=UNNAMED.kind, parameters=parameters)
    return identified.model_copy(update={"known": known, "effects": (entry,)})


def _best_form(folds: Folds, names: Sequence[str]) -> _Form | None:
    """The form that predicts runs left out best; None where none carries over."""
    before = _before(folds, names)
    form = None
    for forms in FORMS:
        best = np.inf
        for option in forms if form is None else ():
            after = _after(folds, option)
            if overall(after) < best and _carries_over(after, before, option):
                best, form = overall(after), option
    return form


def _halves(folds: Folds, names: Sequence[str], form: _Form) -> bool:
    """Whether a form leaves HALF and less of what `identify` leaves of each run left out."""
    return worst_ratio(_after(folds, form), _before(folds, names)) <= HALF


def _before(folds: Folds, names: Sequence[str]) -> RunErrors:
    return {test.run: test.error_n(np.zeros(len(names)), 0.0) for _, test in folds}


def _after(folds: Folds, form: _Form) -> RunErrors:
    return {test.run: test.error_n(*_weights(others, form)) for others, test in folds}


def foretells_every_run(
    problem: Problem, recordings: Sequence[Recording], identified: LegModel
) -> bool:
    """Whether some form of correction, fitted on the other runs, takes HALF and more of what
    `identify` leaves of each run left out, and that is more than no formula of friction is true to:
    then a law is missing.
    """
    runs = Runs.of(problem, recordings)
    names = term_names(runs.series)
    folds = folds_of(runs, names)
    if not folds or not names:
        return False
    before = _before(folds, names)
    friction_n = float(np.mean([test.friction_n for _, test in folds]))
    if overall(before) < LEAST_MISSING * friction_n:
        return False
    return any(_halves(folds, names, form) for forms in FORMS for form in forms)


def _carries_over(after: RunErrors, before: RunErrors, form: _Form) -> bool:
    enough = overall(after) < MUCH[form.level] * overall(before)
    return enough and worst_ratio(after, before) < BETTER


def _weights(left: Sequence[LeftOver], form: _Form) -> tuple[Array, float]:
    """(weights of the terms, constant that keeps the mean of all), N: ridge regression about each
    run's means out and back, then brought to its level; or about its mean, level and all.
    """
    columns = np.vstack([run.columns - run.columns.mean(axis=0) for run in left])
    size = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-12)
    if form.level == "fitted":
        unit = columns / size
        residual = np.concatenate([run.residual_n - run.residual_n.mean() for run in left])
    else:
        unit = np.vstack([run.course(run.columns) for run in left]) / size
        residual = np.concatenate([run.course(run.residual_n) for run in left])
    normal = unit.T @ unit / len(unit) + form.ridge * np.eye(len(size))
    weights = np.linalg.solve(normal, unit.T @ residual / len(unit)) / size
    both = [run for run in left if run.goes_both_ways]
    if both and form.level != "fitted":
        terms = list(both[0].level_terms)
        of_terms = np.array([run.level(run.columns) for run in both])
        wanted = _levels_n(both, of_terms[:, terms]) if form.level == "trend" else 0.0
        missing = wanted - of_terms @ weights
        weights[terms] += np.linalg.lstsq(of_terms[:, terms], missing, rcond=ALIKE)[0]
    return weights, -float(np.mean(np.vstack([run.columns for run in left]) @ weights))


def _levels_n(runs: Sequence[LeftOver], of_terms: Array) -> Array:
    """Level that a correction is given in each run, N, (runs,): the mean of what is left, and of
    its straight trend with the pressure, where that is more than friction's wander from run to run
    makes.

    The trend's share that is kept, 1 - sd^2 / trend^2, is that of James and Stein (1961).
    `of_terms`: levels of LEVEL_TERMS, (runs, 1 or 2), the second one's over the first one's being
    the pressure.
    """
    seen = np.array([float(run.level(run.residual_n)) for run in runs])
    levels = np.full(len(runs), seen.mean())
    if of_terms.shape[1] < len(LEVEL_TERMS):
        return levels
    pressure = of_terms[:, 1] / of_terms[:, 0]
    about = pressure - pressure.mean()
    spread = float(about @ about)
    if spread <= (ALIKE * pressure.mean()) ** 2:
        return levels
    trend = float(about @ seen) / spread
    wander_n = WANDER * float(np.mean([run.friction_n for run in runs]))
    kept = max(0.0, 1.0 - wander_n**2 / max(trend**2 * spread, 1e-12))
    if kept < LEAST_KEPT:
        return levels
    return np.asarray(levels + kept * trend * about, dtype=np.float64)
