"""Which of the names that a search found may be said: each has to pass four trials, and the set as
a whole a fifth.

1. The 90 % interval of its size excludes zero (and what the tolerance of a declared number would
explain). Of a size that is a share of friction's numbers it may be that of their product: what
share it is is as unsure as they are, however plain the force. An effect that says that a declared
number is another one is told against what is declared: no data part it from what the tolerance
took up. A lateness of a drive's force has to be beyond one sample: the recorder's order is as much.
Most of any lateness has to be left where the piston is fast (effect_at_speed.py).
2. With it, recordings left out are predicted better than by the best identified model without it.
3. A repeat of the rig would name it again: it, or a name that this data cannot tell from it, is in
the best set of at least REPEATED of the bootstrap's draws.
4. Without it more is left than a sound bench leaves: by its sensors' noise, and because no formula
of friction is true to the last per cent.
5. No recording left out is predicted worse than `identify` predicts it, by more than WORSE.

A name that fails is taken out, the least repeated first, and the others are tried again. One whose
size is unknown because further shapes stand beside it is tried with the plain law of its name
first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from testbed.diagnosis.leg.bootstrap import Names, wins
from testbed.diagnosis.leg.effect_at_speed import share_at_speed
from testbed.diagnosis.leg.entries import entries_of, memory_of, worth_interval
from testbed.diagnosis.leg.evidence import evidence, of_residual
from testbed.diagnosis.leg.fit import Fit, solve, with_covariance
from testbed.diagnosis.leg.indistinguishable import alike
from testbed.diagnosis.leg.leave_one_out import RunErrors, Runs, overall, worst_ratio
from testbed.diagnosis.leg.points import DECLARED, HELD, point, restarted
from testbed.diagnosis.leg.prediction import block_covariance, held_out
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.rivals import share_of
from testbed.diagnosis.leg.search import Candidate, Search
from testbed.diagnosis.leg.unexplained import is_as_sound
from testbed.effects import by_name
from testbed.estimation.friction.declared_numbers import MOST
from testbed.recording.axis import Recording
from testbed.recording.leg_model import EffectEntry, LegModel

REPEATED = 0.8
BETTER, WORSE = 0.97, 1.02
"""To what share of the error without it a name has to bring the error of runs left out, and how
much worse than `identify` a run may become."""
LEAST_AT_SPEED = 0.7
"""Share of the size of an effect that has to be left where the piston is fast. Of ten legs of two
simulators whose pressures come 0.7 to 7 ms late 0.98 to 1.42 is left, of four sound ones of 300 to
800 kg that ring on their oil 0.30 to 0.51."""


@dataclass(frozen=True)
class Trial:
    """One name before its trials: `repeated`, share of draws; `run_error`, of runs left out with it
    over without it; `at_speed`, share of its size where the piston is fast; `shows`, whether more
    is left without it than a sound bench leaves.
    """

    excludes_zero: bool
    repeated: float
    run_error: float | None = None
    at_speed: float | None = None
    shows: bool = True

    @property
    def failed(self) -> str | None:
        """In words why it is not said; None where it may be."""
        if not self.excludes_zero:
            return "its interval contains zero, or what a tolerance or the recorder explains"
        if self.at_speed is not None and self.at_speed < LEAST_AT_SPEED:
            return f"{100 * self.at_speed:.0f} % of it is left where the piston is fast"
        if self.repeated < REPEATED:
            return f"only {100 * self.repeated:.0f} % of resampled rigs would name it"
        if not self.shows:
            return "without it no more is left than a sound rig leaves"
        if self.run_error is not None and self.run_error > BETTER:
            return f"error of recordings left out: {self.run_error:.2f} of what it is without it"
        return None

    @property
    def too_small(self) -> bool:
        """Whether nothing but its size speaks against it."""
        return not self.shows and replace(self, shows=True).failed is None


@dataclass(frozen=True, eq=False)
class Proof:
    """The set that is left, `won` by share of draws, why others are not said, which of these only
    because a sound bench may leave as much, and the errors of runs left out.

    `run_errors`: `identify`, `refit` as it is written, `after` -> run -> N.
    """

    kept: Candidate
    won: Mapping[Names, float]
    refused: Mapping[str, str] = field(default_factory=dict)
    repeated: Mapping[str, float] = field(default_factory=dict)
    run_errors: Mapping[str, RunErrors] = field(default_factory=dict)
    too_small: tuple[str, ...] = ()


def proven(state: Search, recordings: tuple[Recording, ...]) -> Proof:
    """The names of the search's best set that pass their trials."""
    runs = Runs.of(state.problem, recordings)
    errors = _RunErrors(state, runs)
    identified, refit = runs.identified(), runs.errors(state.refit.fit, as_written=True)
    kept, refused, too_small = _told(state, state.best or state.refit), {}, []
    won = wins(state)
    while kept.names:
        trials = {name: trial(state, kept, name, won) for name in kept.names}
        bent = [
            name
            for name, trial in trials.items()
            if not trial.excludes_zero and _shapes(kept, name)
        ]
        if bent:
            kept = _told(state, plain(state, kept, bent[0]))
            continue
        if all(trial.failed is None for trial in trials.values()):
            trials = {
                name: replace(
                    trial,
                    run_error=errors.without(kept, name, identified),
                    shows=not is_as_sound(state.problem, without(state, kept, name), recordings),
                )
                for name, trial in trials.items()
            }
        failed = [name for name, trial in trials.items() if trial.failed is not None]
        reasons = {name: trials[name].failed or "" for name in failed}
        if not failed and worst_ratio(errors.of(kept), identified) > WORSE:
            failed = list(kept.names)
            reasons = dict.fromkeys(failed, "a recording left out is predicted worse than before")
        if not failed:
            break
        out = min(failed, key=lambda name: trials[name].repeated)
        refused[out] = reasons[out]
        if trials[out].too_small and worst_ratio(errors.of(kept), identified) <= WORSE:
            too_small.append(out)
        kept = _told(state, without(state, kept, out))
    return Proof(
        kept,
        won,
        refused,
        {name: repeated(state, kept, name, won) for name in kept.names},
        {"identify": identified, "refit": refit, "after": errors.of(kept)},
        tuple(too_small),
    )


@dataclass(eq=False)
class _RunErrors:
    """Errors of runs left out, each set of names reckoned once."""

    state: Search
    runs: Runs
    known: dict[Names, RunErrors] = field(default_factory=dict)

    def of(self, candidate: Candidate) -> RunErrors:
        names = frozenset(candidate.names)
        if names not in self.known:
            self.known[names] = self.runs.errors(candidate.fit)
        return self.known[names]

    def without(self, candidate: Candidate, name: str, identified: RunErrors) -> float:
        """Overall error with all names, over that of the better of `identify` and of the set
        without one of them.
        """
        rest = self.of(without(self.state, candidate, name))
        return overall(self.of(candidate)) / max(min(overall(rest), overall(identified)), 1e-12)


def worse_than(state: Search, candidate: Candidate, identified: LegModel) -> bool:
    """Whether the force of blocks left out is worse with a set than as identified; never where none
    of its names shows in the force. Of a leg's recordings often only one shows an effect at all, so
    blocks are left out and not runs.
    """
    problem = state.problem
    if not any("force" in by_name(name).seen_in for name in candidate.names):
        return False
    left_out = held_out(problem, candidate.fit)["force"]
    residuals = left_out, problem.force(identified, problem.believed)
    with_it, as_identified = (
        of_residual(problem, {"force": residual}).rms for residual in residuals
    )
    return overall(with_it) > WORSE * overall(as_identified)


def _shapes(candidate: Candidate, name: str) -> set[str]:
    """The further shapes of one effect that were fitted."""
    return {
        coordinate.name for coordinate in candidate.fit.coordinates if coordinate.owner == name
    } & set(by_name(name).shapes)


def plain(state: Search, candidate: Candidate, name: str) -> Candidate:
    """The same set with the law of one name as it is written, without further shapes."""
    shapes = _shapes(candidate, name)
    at = candidate.fit.at
    effects = tuple(
        replace(
            effect,
            values=effect.effect.complete(
                {key: value for key, value in effect.values.items() if key not in shapes}
            ),
        )
        if effect.effect.name == name
        else effect
        for effect in at.effects
    )
    at = replace(at, effects=effects)
    kept = [
        coordinate
        for coordinate in candidate.fit.coordinates
        if coordinate.owner != name or coordinate.name not in shapes
    ]
    fit = solve(state.problem, [restarted(coordinate, at) for coordinate in kept], at)
    found = Candidate(candidate.names, fit, evidence(state.problem, fit))
    state.tried[frozenset(found.names)] = found
    return found


def _told(state: Search, candidate: Candidate) -> Candidate:
    """The candidate with its declared numbers as declared, and its force acting when it was
    written, where an effect of it says otherwise.
    """
    fit = told_against_declared(state.problem, candidate.fit)
    told = candidate if fit is candidate.fit else replace(candidate, fit=fit)
    late = told_as_late(state.problem, fit)
    if late is not fit:
        told = replace(told, fit=late, evidence=evidence(state.problem, late))
    state.tried[frozenset(told.names)] = told
    return told


def told_as_late(problem: Problem, fit: Fit) -> Fit:
    """The fit with how late a drive's force acts given to the effect that says that it is read
    late. Both move the one force, each the other way, and only their difference shows: beside each
    other neither is known.
    """
    held = (HELD, "held_s")
    for active in fit.at.effects:
        size = (active.effect.name, active.effect.required[0])
        if not active.effect.within_a_sample or held not in owned(fit) or size not in owned(fit):
            continue
        at = replace(fit.at, held_s=0.0)
        net = active.values[size[1]] - fit.at.held_s
        coordinates = [
            replace(restarted(one, at), start=max(net, one.low))
            if (one.owner, one.name) == size
            else restarted(one, at)
            for one in fit.coordinates
            if (one.owner, one.name) != held
        ]
        return solve(problem, coordinates, at)
    return fit


def told_against_declared(problem: Problem, fit: Fit) -> Fit:
    """The fit with what a tolerance took up of a declared number given to the effect that says that
    this number is another one. Both make the same forces, so the residuals are the same; what is
    left to be uncertain is how far the machine is from what is declared.
    """
    for active in fit.at.effects:
        number = active.effect.declared_as
        size = (active.effect.name, active.effect.required[0])
        shaped = any((active.effect.name, shape) in owned(fit) for shape in active.effect.shapes)
        if number is None or number not in fit.at.off or size not in owned(fit) or shaped:
            continue
        taken = float(getattr(problem.base.known, number)) * fit.at.off[number]
        keep = [place for place, one in enumerate(owned(fit)) if one != (DECLARED, number)]
        theta = fit.theta.copy()
        theta[owned(fit).index(size)] += taken
        coordinates = tuple(fit.coordinates[place] for place in keep)
        off = {name: share for name, share in fit.at.off.items() if name != number}
        at = point(coordinates, theta[keep], replace(fit.at, off=off))
        jac = {channel: columns[:, keep] for channel, columns in fit.jacobian.items()}
        fit = with_covariance(problem, coordinates, theta[keep], at, (fit.residual, jac, fit.scale))
    return fit


def owned(fit: Fit) -> list[tuple[str, str]]:
    """(owner, name) of a fit's coordinates, in their order."""
    return [(coordinate.owner, coordinate.name) for coordinate in fit.coordinates]


def without(state: Search, candidate: Candidate, name: str) -> Candidate:
    """The set less one name: as it was tried, or fitted now, with what its effect had taken over
    of the rig's own numbers.
    """
    rest = frozenset(candidate.names) - {name}
    if rest not in state.tried:
        effect, fitted = by_name(name), candidate.fit
        taken = {(DECLARED, effect.declared_as)}
        taken |= {(HELD, "held_s")} if effect.within_a_sample else set()
        tolerated = [
            coordinate
            for coordinate in state.refit.fit.coordinates
            if (coordinate.owner, coordinate.name) in taken - set(owned(fitted))
            or coordinate.owner == name
        ]
        off = state.refit.fit.at.off
        others = tuple(active for active in fitted.at.effects if active.effect.name != name)
        usual = tuple(one for one in state.refit.fit.at.effects if one.effect.name == name)
        at = replace(
            fitted.at,
            effects=(*others, *usual),
            off={one.name: off[one.name] for one in tolerated if one.name in off}
            | dict(fitted.at.off),
        )
        kept = (one for one in fitted.coordinates if one.owner != name)
        coordinates = [restarted(coordinate, at) for coordinate in (*kept, *tolerated)]
        fit = solve(state.problem, coordinates, at)
        names = tuple(key for key in candidate.names if key != name)
        state.tried[rest] = Candidate(names, fit, evidence(state.problem, fit))
    return state.tried[rest]


def trial(state: Search, kept: Candidate, name: str, won: Mapping[Names, float]) -> Trial:
    """The trials of one name that take no refit."""
    memory = memory_of(kept.evidence)
    entries = entries_of(kept.fit, memory, block_covariance(state.problem, kept.fit))
    (entry,) = [entry_ for entry_ in entries if entry_.name == name]
    return Trial(
        _excludes_zero(state, kept.fit, entry, memory),
        repeated(state, kept, name, won),
        at_speed=_at_speed(state, kept, name),
    )


def _at_speed(state: Search, kept: Candidate, name: str) -> float | None:
    effect = by_name(name)
    if not effect.shows_at_speed:
        return None
    return share_at_speed(state.problem, kept.fit, name, effect.required[0])


def repeated(state: Search, kept: Candidate, name: str, won: Mapping[Names, float]) -> float:
    """Share of draws that would name an effect of a set again, or one that does the same along
    these motions: which of them a draw prefers does not say that nothing is there.
    """
    return share_of(name, alike(state, kept, name), won)


def _excludes_zero(state: Search, fit: Fit, entry: EffectEntry, memory: float) -> bool:
    """Whether the size of an effect, its first parameter, is known to be none that the model has
    without it.
    """
    effect = by_name(entry.name)
    size = entry.parameters.get(effect.required[0])
    if size is None or size.interval90 is None:
        return True
    low, high = size.interval90
    number, known = effect.declared_as, state.problem.base.known
    if number is not None and number in state.refit.fit.at.off:
        declared = float(getattr(known, number))
        moved = declared * fit.at.off.get(number, 0.0)  # what the tolerance took up
        most = MOST * declared * known.tolerance(number)
        return low + moved > most or high + moved < -most
    if effect.within_a_sample and state.problem.kind == "drive":
        sample_s = state.problem.sample_s
        return low > sample_s or high < -sample_s
    usual = effect.usual_on(state.problem.kind, state.problem.sample_s)
    if usual is not None:
        return low > usual[1] or high < usual[0]
    if low > 0.0 or high < 0.0:
        return True
    worth = worth_interval(fit, effect, memory, block_covariance(state.problem, fit))
    return worth is not None and (worth[0] > 0.0 or worth[1] < 0.0)
