"""What an identified model leaves of each run of a bench or a drive, with the generic terms that
may correct it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.leave_one_out import Runs
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.run_variation import dry_friction_n
from testbed.diagnosis.leg.series import Series
from testbed.effects.unnamed import correction_terms, edges_of
from testbed.recording.leg_model import LegModel

Array = npt.NDArray[np.float64]
LEVELS = ("bias", "pressure_a", "pressure_a_2", "pressure_b", "pressure_b_2")
"""Generic terms that say nothing within a run of one pressure."""
LEVEL_TERMS = ("sliding_2_mm_s", "pressure_sliding_2_mm_s")
"""Terms that bring a correction to its level: friction, and friction that grows with pressure."""


@dataclass(frozen=True, eq=False)
class LeftOver:
    """What a model leaves of one run: residual (bins,) N, the terms' columns (bins, terms), which
    bins extend, the mean dry friction, N, which terms bring a correction to its level, and the
    pressure of A, Pa, with its standard deviation, where it has one.
    """

    run: str
    residual_n: Array
    columns: Array
    extends: npt.NDArray[np.bool_]
    friction_n: float
    level_terms: tuple[int, ...]
    pressure_pa: float = 0.0
    pressure_sd_pa: float = 0.0

    def error_n(self, weights: Array, bias: float) -> float:
        """Root mean square with these weights of the terms, and this constant."""
        return float(np.sqrt(np.mean((self.residual_n - bias - self.columns @ weights) ** 2)))

    @property
    def goes_both_ways(self) -> bool:
        """Whether it tells friction from a constant."""
        return bool(self.extends.any() and not self.extends.all())

    def level(self, values: Array) -> Array:
        """Half of what values (bins, ..) differ by, out and back: (..)."""
        out, back = values[self.extends], values[~self.extends]
        return np.asarray(0.5 * (out.mean(axis=0) - back.mean(axis=0)), dtype=np.float64)

    def zero(self, values: Array) -> float:
        """Mean of values (bins,) out and of those back, which no friction has."""
        return float(0.5 * (values[self.extends].mean() + values[~self.extends].mean()))

    def course(self, values: Array) -> Array:
        """Values (bins, ..) about their means out and back."""
        left = values.copy()
        for way in (self.extends, ~self.extends):
            if way.any():
                left[way] -= left[way].mean(axis=0)
        return left


Folds = Sequence[tuple[list[LeftOver], LeftOver]]
"""For each run: (what the model identified on the others leaves of these, and of this one)."""


def term_names(series: Sequence[Series]) -> tuple[str, ...]:
    """The terms that every run has the channels of."""
    of_runs = [correction_terms(one.signals, {}) for one in series]
    return tuple(
        name
        for name in of_runs[0]
        if name not in LEVELS and all(name in terms for terms in of_runs)
    )


def left_over(
    series: Sequence[Series],
    model: LegModel,
    problem: Problem,
    names: Sequence[str],
    edges: Mapping[str, float],
) -> list[LeftOver]:
    """What a model leaves of runs, with the terms of these names held at the edges."""
    level_terms = tuple(names.index(name) for name in LEVEL_TERMS if name in names)
    out = []
    for one in series:
        judged = Problem((one,), problem.base, problem.with_flow)
        counted = judged.layout["force"].count > 0
        mask = one.trusted & one.clear
        terms = correction_terms(one.signals, edges)
        columns = [one.binned(terms[name], mask)[0][counted] for name in names]
        residual_n = judged.force(model, ())[counted] / judged.as_read(model, ())
        if residual_n.size:
            velocity = one.binned(one.signals.velocity_m_s, mask)[0][counted]
            friction = np.abs(dry_friction_n(one, model.friction).sum(axis=1))[counted].mean()
            extends = np.asarray(velocity > 0.0, dtype=np.bool_)
            pressure = one.signals.pressure_a_pa
            found = LeftOver(
                run=one.name,
                residual_n=residual_n,
                columns=np.column_stack(columns),
                extends=extends,
                friction_n=float(friction),
                level_terms=level_terms,
                pressure_pa=0.0 if pressure is None else float(np.median(pressure)),
                pressure_sd_pa=0.0 if pressure is None else float(np.std(pressure)),
            )
            out.append(found)
    return out


def folds_of(runs: Runs, names: Sequence[str]) -> Folds:
    """For each run: (what the model identified on the others leaves of these, and of this one)."""
    out = []
    for index, test in enumerate(runs.series):
        model = runs.identified_without(index)
        rest = (*runs.series[:index], *runs.series[index + 1 :])
        edges = edges_of(series.signals for series in rest)
        found = left_over((test,), model, runs.problem, names, edges)
        others = left_over(rest, model, runs.problem, names, edges)
        if found and others:
            out.append((others, found[0]))
    return out
