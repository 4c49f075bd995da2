"""The search through sets of effects: a refit first, then one effect, its shapes, another, and
exchanges.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from testbed.diagnosis.leg.evidence import Evidence, evidence
from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.hypotheses import LeftOut, available, fit_shapes, fit_with, promise
from testbed.diagnosis.leg.problem import Problem
from testbed.effects import by_name, place_of
from testbed.effects.base import Effect
from testbed.effects.parameter_spec import STANDARD_DEVIATIONS_OF_90

LEAST_GAIN = 6.0
"""Log-likelihood that a further shape or effect has to gain on held-out blocks to be looked at."""
MOST_UNLIKELY = 10.0
LEAST_FALL = 0.012
"""Relative fall of some group's noise that it has to bring."""
FITTED_FIRST, FITTED_THEN = 9, 5
"""How many of the effects that promise most are fitted in full: as a first effect, as a further
one.
"""
SHAPED_BY_PROMISE = 2
"""How many of the effects that promise most get their shapes as a first effect, whatever their
plain law gains.
"""
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Candidate:
    """A set of effects, fitted: `gain` over the refit in held-out log-likelihood (filled against a
    common memory).
    """

    names: tuple[str, ...]
    fit: Fit
    evidence: Evidence


@dataclass(eq=False)
class Search:
    """Everything that was tried on a rig."""

    problem: Problem
    refit: Candidate
    tried: dict[frozenset[str], Candidate] = field(default_factory=dict)
    order: list[str] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)
    best: Candidate | None = None

    def gain(self, candidate: Candidate, memory: Evidence | None = None) -> float:
        """Held-out log-likelihood over the refit, at the correlation times of the best
        description.
        """
        best = memory or (self.best or self.refit).evidence
        return candidate.evidence.gain_over(self.refit.evidence, best) - self.price(candidate)

    def price(self, candidate: Candidate) -> float:
        """What flexibility and parameters beyond what is expected of an effect cost a candidate."""
        new = [
            effect for effect in candidate.fit.at.effects if effect.effect.name in candidate.names
        ]
        total = _unlikely(candidate, self.problem)
        if new:
            observed = self.problem.observed(candidate.fit.at.friction)
            total += sum(active.effect.price(active.values, observed) for active in new)
        return total

    def fall(self, candidate: Candidate, other: Candidate) -> float:
        """Largest relative fall of a group's noise from one candidate to another."""
        return candidate.evidence.largest_fall(other.evidence, self.problem.unsure)


def _unlikely(candidate: Candidate, problem: Problem) -> float:
    """On one leg of four, whose rivals often explain the same: half the square of standard
    deviations by which a parameter leaves its prior range, at most MOST_UNLIKELY each.
    """
    if problem.kind != "robot":
        return 0.0
    total = 0.0
    for coordinate, theta in zip(candidate.fit.coordinates, candidate.fit.theta, strict=True):
        if place_of(coordinate.owner):
            low, high = by_name(coordinate.owner).spec(coordinate.name).prior
            low, high = (np.log(low), np.log(high)) if coordinate.log else (low, high)
            beyond = max(low - theta, theta - high, 0.0) / (
                (high - low) / STANDARD_DEVIATIONS_OF_90
            )
            total += min(0.5 * beyond**2, MOST_UNLIKELY)
    return float(total)


def search(
    problem: Problem,
    refit: Fit,
    most: int = 2,
    progress: Progress | None = None,
    hypotheses: tuple[list[Effect], list[LeftOut]] | None = None,
) -> Search:
    """Forward through sets of up to `most` effects, each step with exchanges; all candidates are
    kept.

    `hypotheses`: (effects to try, effects left out), by default those that the problem's channels
    can show.
    """
    tell = progress or (lambda _: None)
    effects, left_out = hypotheses or available(problem)
    base = Candidate((), refit, evidence(problem, refit))
    state = Search(problem, base, {frozenset(): base}, [], left_out, base)
    current = base
    for depth in range(most):
        tell(f"effect {depth + 1}")
        step = _step(state, current, effects)
        if step is None:
            break
        current = step
        if depth > 0:
            current = _exchange(state, current, effects)
    state.best = current
    state.order = list(current.names)
    return state


def _step(state: Search, current: Candidate, effects: list[Effect]) -> Candidate | None:
    """The best set with one more effect, its shapes fitted where they help; None if nothing
    helps.
    """
    most = FITTED_FIRST if not current.names else FITTED_THEN
    options = [_add(state, current, effect) for effect in _promising(state, current, effects, most)]
    ranked = sorted(options, key=lambda c: -_between(c, current, state))
    if not ranked or not _helps(ranked[0], current, state):
        return None
    # Shapes may turn the tables between the first few: all of them get theirs.
    leaders = [
        candidate
        for candidate in ranked[:3]
        if _between(candidate, current, state) > 0.5 * _between(ranked[0], current, state)
    ]
    if (
        not current.names
    ):  # a law of another form may carry over to no other block, but its right shape does
        leaders += [option for option in options[:SHAPED_BY_PROMISE] if option not in leaders]
    shaped = [_shape(state, leader) for leader in leaders]
    best = max(shaped, key=lambda c: _between(c, current, state))
    for c in shaped:
        state.tried[frozenset(c.names)] = c
    state.best = best
    return best


def _promising(state: Search, current: Candidate, effects: list[Effect], most: int) -> list[Effect]:
    """The effects with the largest linearised promise; those that are far from linear are always
    tried.
    """
    rest = [effect for effect in effects if effect.name not in current.names]
    promised = {effect.name: promise(state.problem, current.fit, effect) for effect in rest}
    first = sorted(rest, key=lambda e: -promised[e.name])[:most]
    return first + [effect for effect in rest if effect.far_from_linear and effect not in first]


def _between(candidate: Candidate, other: Candidate, state: Search) -> float:
    """Gain of one candidate over another, at the first one's correlation times."""
    price = state.price(candidate) - state.price(other)
    return candidate.evidence.gain_over(other.evidence, candidate.evidence) - price


def _ahead(candidate: Candidate, other: Candidate, state: Search) -> bool:
    """Whether one set is ahead of another at the correlation times of either: at the long ones of a
    bad description any likelihood is small beside what a parameter costs.
    """
    forth, back = _between(candidate, other, state), _between(other, candidate, state)
    return forth > LEAST_GAIN and back < -LEAST_GAIN


def _helps(candidate: Candidate, other: Candidate, state: Search) -> bool:
    return (
        _between(candidate, other, state) > LEAST_GAIN and state.fall(candidate, other) > LEAST_FALL
    )


def _add(state: Search, current: Candidate, effect: Effect) -> Candidate:
    names = (*current.names, effect.name)
    key = frozenset(names)
    fit = fit_with(state.problem, current.fit, effect)
    candidate = Candidate(names, fit, evidence(state.problem, fit))
    known = state.tried.get(key)
    if known is None or _between(candidate, known, state) > 0.0:
        state.tried[key] = candidate
    return candidate


def _shape(state: Search, candidate: Candidate) -> Candidate:
    """The candidate with further shapes of its last effect, if they predict held-out blocks better.

    Not on one leg of the robot: a bent law of a wrong name would outdo the right one there.
    """
    if state.problem.kind == "robot":
        return candidate
    effect = by_name(candidate.names[-1])
    if not effect.shapes:
        return candidate
    fit = fit_shapes(state.problem, candidate.fit, effect)
    shaped = Candidate(candidate.names, fit, evidence(state.problem, fit))
    return shaped if _helps(shaped, candidate, state) else candidate


def _exchange(state: Search, pair: Candidate, effects: list[Effect]) -> Candidate:
    """Each effect but the last is taken out and every other one tried in its place, the last being
    kept.
    """
    best = pair
    for out in pair.names[:-1]:
        rest = tuple(name for name in best.names if name != out)
        without = state.tried.get(frozenset(rest))
        if without is None:
            continue
        outside = [effect for effect in effects if effect.name not in best.names]
        found = [
            _add(state, without, effect)
            for effect in _promising(state, without, outside, FITTED_THEN)
        ]
        leader = max(found, key=lambda c: _between(c, best, state), default=None)
        if leader is not None:
            leader = _shape(state, leader)
            if _ahead(leader, best, state):
                best = leader
                state.tried[frozenset(best.names)] = best
    return best
