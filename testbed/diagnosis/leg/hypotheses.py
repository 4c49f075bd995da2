"""Which effects a rig's recordings can show, and the fit of one more of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.evidence import Key, of_residual
from testbed.diagnosis.leg.fit import Fit, solve, step_gain
from testbed.diagnosis.leg.points import restarted
from testbed.diagnosis.leg.problem import Problem
from testbed.effects import OF_A_CYLINDER
from testbed.effects.active import Active
from testbed.effects.base import Effect
from testbed.effects.terms import Coordinate, Values

Array = npt.NDArray[np.float64]
MOST_STARTS = 2
"""Of more starting values those are fitted in full that promise most."""
ITERATIONS = 20


@dataclass(frozen=True)
class LeftOut:
    """A hypothesis that this data cannot show, and why."""

    name: str
    reason: str


def available(problem: Problem) -> tuple[list[Effect], list[LeftOut]]:
    """Effects that the rig's channels and motions can show, and those left out with the reason."""
    use: list[Effect] = []
    out: list[LeftOut] = []
    for effect in OF_A_CYLINDER:
        reason = _why_not(problem, effect)
        if reason is None:
            use.append(effect)
        else:
            out.append(LeftOut(effect.name, reason))
    return use, out


def _why_not(problem: Problem, effect: Effect) -> str | None:
    """Why an effect is no hypothesis on this rig; None where it is one."""
    if effect.name in {active.effect.name for active in problem.believed}:
        return "the model has it already"
    if effect.declared_as in problem.not_declared:
        return "nobody declares that number: it is fitted, and no finding"
    if problem.base.rig not in effect.rigs:
        return f"does not exist in a rig of kind {problem.base.rig}"
    channels = _channels(problem)
    missing = [need for need in effect.needs if need not in channels]
    if missing:
        return f"needs the channel {missing[0]}"
    return effect.unseen(problem.observed(problem.base.friction))


def _channels(problem: Problem) -> set[str]:
    """The channels that every recording of the rig has."""
    signals = [series.signals for series in problem.series]
    found = {"position"} | ({"valve_command"} if problem.with_flow else set())
    for channel, values in (
        ("pressure_a", [signal.pressure_a_pa for signal in signals]),
        ("pressure_b", [signal.pressure_b_pa for signal in signals]),
        ("oil_temperature", [signal.oil_temperature_degc for signal in signals]),
        ("supply_pressure", [signal.supply_pressure_pa for signal in signals]),
    ):
        if all(value is not None for value in values):
            found.add(channel)
    return found


def fit_with(problem: Problem, before: Fit, effect: Effect) -> Fit:
    """A fit with one more effect, the best from its starts."""
    starts = effect.starts(problem.observed(before.at.friction, before))
    if len(starts) > MOST_STARTS:
        promised = [_promised(problem, before, effect, start) for start in starts]
        best = np.argsort([-promise_ for promise_ in promised], kind="stable")[:MOST_STARTS]
        starts = [starts[place] for place in best]
    memory = of_residual(problem, before.residual).memory
    fits = [_fitted(problem, before, effect, start) for start in starts]
    return _continued(problem, min(fits, key=lambda fit: _cost(problem, fit, memory)))


def _continued(problem: Problem, fit: Fit) -> Fit:
    """The fit gone on with from where its iterations ended, with the noise that it leaves: what
    explains nearly all began beside a noise many times that.
    """
    coordinates = [restarted(coordinate, fit.at) for coordinate in fit.coordinates]
    return solve(problem, coordinates, fit.at, ITERATIONS, fit.scale)


def fit_shapes(problem: Problem, before: Fit, effect: Effect) -> Fit:
    """A fit in which an effect that is there already has all its further shapes."""
    start = next(active.values for active in before.at.effects if active.effect.name == effect.name)
    return _fitted(problem, before, effect, start, effect.shapes)


def _fitted(
    problem: Problem, before: Fit, effect: Effect, start: Values, shapes: Sequence[str] = ()
) -> Fit:
    others = [coordinate for coordinate in before.coordinates if coordinate.owner != effect.name]
    coordinates = [restarted(other, before.at) for other in others]
    coordinates += narrowed(problem, effect, start, shapes)
    fixed = before.at
    if effect.band_amplitude is not None:  # a number that is there without being fitted
        rest = [active for active in fixed.effects if active.effect.name != effect.name]
        fixed = replace(fixed, effects=(*rest, Active(effect, effect.complete(start))))
    return solve(problem, coordinates, fixed, ITERATIONS, before.scale)


def narrowed(
    problem: Problem, effect: Effect, start: Values, shapes: Sequence[str] = ()
) -> list[Coordinate]:
    """An effect's coordinates from `start`, with the bounds that these recordings call for and the
    scales of this machine's size.
    """
    observed, out = problem.observed(problem.base.friction), []
    for coordinate in effect.coordinates(start, shapes):
        spec = effect.spec(coordinate.name)
        factor = observed.size(spec.unit)
        sized = effect.narrowed(coordinate, observed).sized(factor, spec.low, spec.high)
        known = coordinate.name in start
        out.append(sized if known else replace(sized, start=sized.start * factor))
    return out


def promise(problem: Problem, before: Fit, effect: Effect) -> float:
    """Fall of the robust cost that one linearised step with the effect promises (best of its
    starts).
    """
    observed = problem.observed(before.at.friction, before)
    promised = effect.promise(observed)
    if promised is not None:
        return promised
    return max(_promised(problem, before, effect, start) for start in effect.starts(observed))


def _promised(problem: Problem, before: Fit, effect: Effect, start: Values) -> float:
    extra = narrowed(problem, effect, start)
    others = [coordinate for coordinate in before.coordinates if coordinate.owner != effect.name]
    both = [*(restarted(other, before.at) for other in others), *extra]
    return step_gain(problem, before, both, len(extra))


def _cost(problem: Problem, fit: Fit, memory: Mapping[Key, float]) -> float:
    """Less is better; `memory`: correlation times that are the same for all that are compared."""
    found = of_residual(problem, fit.residual)
    return -sum(value / memory[name] for name, value in found.log_likelihood.items())
