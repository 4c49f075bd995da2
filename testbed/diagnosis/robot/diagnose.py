"""`testbed diagnose RUN`: the leg of the whole robot that does not fit its model, and by which effect."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.base_models import EDGE
from testbed.diagnosis.leg.entries import entries_of
from testbed.diagnosis.leg.evidence import FEWEST
from testbed.diagnosis.leg.fit import Fit, residuals, solve
from testbed.diagnosis.leg.hypotheses import LeftOut, available, narrowed
from testbed.diagnosis.leg.points import Point, friction_coordinates, restarted
from testbed.diagnosis.leg.search import Search, search
from testbed.diagnosis.leg.series import BIN, RATE_HZ, series_of
from testbed.diagnosis.leg.verdict import Verdict, verdict_of
from testbed.diagnosis.robot.probabilities import calibration, distribution, signs_of
from testbed.diagnosis.robot.problem import RobotProblem
from testbed.diagnosis.robot.rig import (
    believed_model,
    granted_effects,
    recordings_of,
)
from testbed.diagnosis.robot.zeros import without_zeros, zeros
from testbed.effects import declared_by, of_declared, place_of
from testbed.effects.base import Active, Effect
from testbed.effects.fitting import Coordinate
from testbed.errors import InputError
from testbed.estimation.leg.flow import Edge
from testbed.machine.model import Machine
from testbed.recording.leg_model import EffectEntry, LegModel

Array = npt.NDArray[np.float64]
LEARNT_SHARE, SETTLING_S = 0.65, 0.5
"""The first part of a run is learnt from, less the time in which the start settles; the rest is kept for judging."""
SHORTEST_S = (SETTLING_S + 2 * FEWEST * BIN / RATE_HZ) / LEARNT_SHARE
"""Of a shorter run neither the sliding nor the resting part of a leg need have enough bins to tell its noise."""
SLIDING_BINS = 150
"""Fewer than this: no piston slides, friction stays as declared and no hypothesis about it is made."""
FREE_ON_THE_ROBOT = ("internal_leakage_m3_s_pa", "valve_deadband")
"""Declared numbers that differ from machine to machine: fitted for all legs alike, and no findings."""
MOST_EFFECTS = 2
FRICTION_SCALE_N = 100.0
RESTARTS, SETTLED = 4, 0.02
"""Fits of what all legs share, each from the answer of the one before, until no number moves by this share of its
scale: whatever it has not found yet would count as the gain of any effect."""
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class RobotDiagnosis:
    """What was found on one run. `errors`: axis -> before, refit, after: RMS residual (N) on the part kept back."""

    name: str
    problem: RobotProblem
    kept_back: RobotProblem
    state: Search
    verdict: Verdict
    models: dict[str, LegModel]
    entries: tuple[EffectEntry, ...]
    errors: dict[str, dict[str, float]]
    slides: bool
    points: dict[str, Point]

    def total(self) -> dict[str, float]:
        """Stage -> RMS over the four legs, N."""
        rows = list(self.errors.values())
        return {
            stage: float(np.sqrt(np.mean([row[stage] ** 2 for row in rows]))) for stage in rows[0]
        }


def check_duration(time_s: Array, file: Path) -> None:
    """Refuse a run, times (n,) in s, that is too short to learn from."""
    duration = float(time_s[-1] - time_s[0])
    if duration < SHORTEST_S:
        raise InputError(
            f"is too short to diagnose: {duration:.3g} s",
            file=file,
            allowed=f"at least {SHORTEST_S:.3g} s",
        )


def diagnose_robot(
    name: str,
    data: Mapping[str, Array],
    machine: Machine,
    folder: Path,
    progress: Progress | None = None,
    start: LegModel | None = None,
) -> RobotDiagnosis:
    """`data`: columns of the run's recording (never its truth); `machine`: the robot as it believes itself to be.

    `start`: a model of an earlier diagnosis; its effects are granted, and what is looked for is what it lacks.
    Raises InputError where a column is missing.
    """
    tell = progress or (lambda _: None)
    tell("reading four legs")
    recordings = recordings_of(data, machine, folder)
    series = series_of(recordings)
    model = believed_model(recordings[0].known, machine, start)
    first, last = float(data["t"][0]), float(data["t"][-1])
    middle = first + LEARNT_SHARE * (last - first)
    problem = RobotProblem(series, model, True, window_s=(first + SETTLING_S, middle))
    kept_back = RobotProblem(series, model, True, window_s=(middle, np.inf))
    slides = problem.slides() > SLIDING_BINS
    tell("what all legs have in common")
    granted = granted_effects(start) if start is not None else ()
    taken = {a.effect.name for a in granted}
    everywhere = tuple(a for a in declared_by(machine) if a.effect.name not in taken)
    offsets, free = zeros(problem, machine)
    before = Point(model.friction, Edge(), (*everywhere, *granted, *offsets))
    fit = _common(problem, before, slides, free)
    state = search(problem, fit, MOST_EFFECTS, tell, _hypotheses(problem, slides, taken))
    verdict = verdict_of(state, distribution(signs_of(state), calibration()))
    chosen = verdict.chosen.fit if verdict.kind == "effect" else fit
    memory = float(
        np.median(
            [v for k, v in verdict.chosen.evidence.memory.items() if k[0].startswith("force")]
        )
    )
    entries = entries_of(without_zeros(chosen), memory)
    points = {"before": before, "refit": fit.at, "after": chosen.at}
    named = tuple(e for e in entries if e.place)
    models = {
        "before": model if start is None else start,
        "refit": model.model_copy(
            update={"friction": fit.at.friction, "effects": _placed(fit, memory)}
        ),
        # What all legs share takes up errors of the expected loads too: only what one leg alone shows is believed.
        "after": model.with_effects(named),
    }
    errors = {stage: _rms(kept_back, point) for stage, point in points.items()}
    table = {
        axis: {stage: errors[stage][axis] for stage in points} for axis in (s.name for s in series)
    }
    return RobotDiagnosis(
        name, problem, kept_back, state, verdict, models, entries, table, slides, points
    )


def _common(problem: RobotProblem, before: Point, slides: bool, free: Sequence[Coordinate]) -> Fit:
    """What all four legs share: friction (where pistons slide), the declared effects' sizes, the valve's edges; and
    what is free in each leg without being a finding.
    """
    coordinates: list[Coordinate] = list(free)
    if slides:
        coordinates += friction_coordinates(before.friction, FRICTION_SCALE_N)
        for active in before.effects:
            if active.effect.is_friction:
                coordinates += active.effect.coordinates(active.values)
    coordinates += EDGE
    for number in FREE_ON_THE_ROBOT:
        effect = of_declared(number)
        if effect.name in {a.effect.name for a in before.effects}:
            continue
        (parameter,) = effect.required
        start = {parameter: getattr(problem.base.known, number) or 0.0}
        before = replace(before, effects=(*before.effects, Active(effect, effect.complete(start))))
        coordinates += narrowed(problem, effect, effect.coordinates(start))
    fit = solve(problem, coordinates, before, iterations=20)
    for _ in range(
        RESTARTS
    ):  # the noise of all groups is estimated on the way: from the answer it is another one
        before_it, fit = (
            fit,
            solve(problem, [restarted(c, fit.at) for c in fit.coordinates], fit.at, iterations=20),
        )
        moved = np.abs(fit.theta - before_it.theta) / [c.scale for c in fit.coordinates]
        if moved.max(initial=0.0) < SETTLED:
            break
    return fit


def _hypotheses(
    problem: RobotProblem, slides: bool, granted: Collection[str]
) -> tuple[list[Effect], list[LeftOut]]:
    use, out = available(problem)
    placed: list[Effect] = []
    for effect in use:
        if not effect.sought_on_robot:
            out.append(LeftOut(effect.name, "is not looked for on a single leg of the robot"))
        elif not slides and (effect.is_friction or effect.needs_sliding):
            out.append(LeftOut(effect.name, "no piston slides in this run"))
        else:
            placed += [effect.at(s.name) for s in problem.series]
    out += [LeftOut(name, "the model has it already") for name in granted if place_of(name)]
    return [e for e in placed if e.name not in granted], out


def _rms(problem: RobotProblem, point: Point) -> dict[str, float]:
    """Root mean square of each axis' force residual in the problem's window, N."""
    layout = problem.layout["force"]
    values = residuals(problem, point, ("force",))["force"]
    out, first = {}, 0
    for s in problem.series:
        here = slice(first, first + s.bins)
        first += s.bins
        kept = values[here][layout.count[here] > 0]
        out[s.name] = float(np.sqrt(np.mean(kept**2))) if kept.size else 0.0
    return out


def _placed(fit: Fit, memory: float) -> tuple[EffectEntry, ...]:
    return tuple(e for e in entries_of(without_zeros(fit), memory) if e.place)
