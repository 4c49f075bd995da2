"""From evidence to a verdict: probabilities over sets of names, refusal, and groups that the data
cannot tell apart.

For legs with declared sensors and valve the probabilities come from `probabilities`, whose numbers
are fitted on rigs of the independent reference leg (`testbed evaluate-diagnosis` judges on others);
no number was fitted to an outside recording. Three constants of the balances were chosen on outside
rigs, which are therefore no blind test of them: the orifice's smoothing (0.5 bar), the command's
lead (0.75 sample; from there the recorder's own order is fitted), the pre-sliding travel (0.12 mm).
Benches and drives, which declare less, have numbers of their own (`bench_probabilities`) and every
name on trial (`proof`); so has a leg of the robot (`diagnosis.robot.probabilities`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Set
from dataclasses import dataclass, field, replace

from testbed.diagnosis.leg import bench_probabilities as bench
from testbed.diagnosis.leg.acceptance import Proof, trial, worse_than
from testbed.diagnosis.leg.bootstrap import Names, wins
from testbed.diagnosis.leg.entries import at_bounds
from testbed.diagnosis.leg.fit_cost import dearest
from testbed.diagnosis.leg.indistinguishable import alike
from testbed.diagnosis.leg.probabilities import (
    beyond_none,
    calibration,
    distribution,
    standing,
)
from testbed.diagnosis.leg.rival_laws import BENT, other_laws, other_laws_within
from testbed.diagnosis.leg.rivals import near
from testbed.diagnosis.leg.search import LEAST_FALL, LEAST_GAIN, Candidate, Search
from testbed.diagnosis.leg.signs import signs
from testbed.diagnosis.leg.stroke_line import stroke_line
from testbed.diagnosis.leg.unexplained import Unexplained
from testbed.effects import by_name
from testbed.recording.leg_model import LegModel


@dataclass(frozen=True)
class Verdict:
    """`kind`: effect, none or unnamed. `hypotheses`: (names, probability), adding up to 1, best
    first.
    """

    kind: str
    chosen: Candidate
    hypotheses: tuple[tuple[tuple[str, ...], float], ...]
    ambiguous: dict[str, tuple[str, ...]]
    goes_with: Mapping[str, float] = field(default_factory=dict)
    """Channels that ride along and go with what has no name -> share by which they lower the
    residual.
    """
    at_bounds: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Chosen name -> its numbers that end at a bound: another law than the name's is asked for."""

    def probability(self, name: str) -> float:
        """Probability that the effect is there: of all sets that hold it."""
        return float(sum(p for names, p in self.hypotheses if name in names))


def decide(state: Search, found: Unexplained, identified: LegModel) -> Verdict:
    """The distribution over sets and the verdict on a leg with declared sensors and valve.

    A name whose interval contains zero, that a resampled rig would not name, that explains at the
    cost of another recording, or with which the foot's force is predicted worse than by the
    `identified` model, hands its probability to the sets without it. Blocks are drawn anew within
    their recordings: each of a leg's is a motion of its own kind. Names are tried before those that
    end at their bounds are doubted, and again after: what a refused name was given speaks for no
    law without a name. Where names helped and failed, no name has to stand on what it leaves.
    Names that passed beside each other are not tried again without one that is doubted: what it
    explains would look like their cost. A line along the stroke that is left by
    what is believed then speaks for what no name covers, and so do shapes of a name that make
    another law of it.
    """
    won, searched = wins(state, recordings_too=False), dict(state.tried)  # trials fit others too
    features = signs(state, found)
    believed = _tried(state, distribution(features, calibration()), won, identified)
    passed = frozenset(verdict_of(state, believed).chosen.names)
    weights = _tried(state, doubted(searched, believed), won, identified, passed)
    if features.best.names:  # of no name `distribution` asked it
        weights = standing(weights, beyond_none(features, calibration()))
        weights = _tried(state, weights, won, identified, passed)
    verdict = verdict_of(state, weights)
    if verdict.kind != "unnamed" and _leaves_a_line(state, verdict.chosen):
        verdict = verdict_of(state, without_a_name(weights, frozenset(weights), RIPPLED))
    elif verdict.kind == "effect" and (others := other_laws(state, verdict.chosen)):
        held = frozenset(names for names in weights if others & set(names))
        verdict = verdict_of(state, without_a_name(weights, held, BENT))
    if verdict.kind != "effect":
        return verdict
    return replace(verdict, ambiguous=_with_alike(state, verdict))


def _tried(
    state: Search,
    weights: Mapping[tuple[str, ...], float],
    won: Mapping[Names, float],
    identified: LegModel,
    passed: Names = frozenset(),
) -> Mapping[tuple[str, ...], float]:
    """The weights once the names of the likeliest set have passed their trials; `passed`: together
    before.
    """
    verdict = verdict_of(state, weights)
    while verdict.kind == "effect" and not passed.issuperset(verdict.chosen.names):
        failed = _failed(state, verdict.chosen, won, identified)
        if not failed:
            break
        weights = handed_on(state, weights, frozenset(failed))
        verdict = verdict_of(state, weights)
    return weights


def _failed(
    state: Search, chosen: Candidate, won: Mapping[Names, float], identified: LegModel
) -> list[str]:
    """The names of a set that fail a trial; where each passes its own, the dearest, or all where
    the set as a whole is worse than no name.
    """
    failed = [name for name in chosen.names if trial(state, chosen, name, won).failed]
    if failed:
        return failed
    if (dear := dearest(state, chosen, chosen.names)) is not None:
        return [dear]
    return list(chosen.names) if worse_than(state, chosen, identified) else []


def handed_on(
    state: Search, weights: Mapping[tuple[str, ...], float], failed: Names
) -> dict[tuple[str, ...], float]:
    """The weights with those of sets that hold a failed name given to the sets without it, where
    those were tried and improve on none, or else to none.
    """
    out: dict[tuple[str, ...], float] = {}
    for names, weight in weights.items():
        left = tuple(name for name in names if name not in failed)
        if left != names and not _improves(state, left):
            left = ()
        out[left] = out.get(left, 0.0) + weight
    return out


def _improves(state: Search, names: tuple[str, ...]) -> bool:
    """Whether a set of names alone gains what the search asks for: some names only help beside
    another.
    """
    found = state.tried.get(frozenset(names))
    return (
        found is not None
        and state.gain(found) > LEAST_GAIN
        and state.fall(found, state.refit) > LEAST_FALL
    )


def doubted(
    tried: Mapping[Names, Candidate], weights: Mapping[tuple[str, ...], float]
) -> dict[tuple[str, ...], float]:
    """The weights with half of each set's given away that holds a name whose numbers end at their
    bounds: the data ask for another law than that name's, which is as likely as it. It goes to the
    sets that hold the rest and no such name, as they stand to each other, for what speaks for a
    second effect does not speak for the first alone; or where nothing is left to what no name
    covers.
    """
    rests = {names: _without_ended(tried, names) for names in weights}
    out = {names: 0.0 for names in weights}
    for names, weight in weights.items():
        rest = rests[names]
        if rest == names:
            out[names] += weight
            continue
        out[names] += 0.5 * weight
        for heir, share in _heirs(tried, weights, rests, rest).items():
            out[heir] = out.get(heir, 0.0) + 0.5 * weight * share
    return out


def _without_ended(tried: Mapping[Names, Candidate], names: tuple[str, ...]) -> tuple[str, ...]:
    """A set's names without those whose numbers end at their bounds."""
    candidate = tried.get(frozenset(names))
    ended = at_bounds(candidate.fit) if candidate else {}
    return tuple(name for name in names if name not in ended)


def _heirs(
    tried: Mapping[Names, Candidate],
    weights: Mapping[tuple[str, ...], float],
    rests: Mapping[tuple[str, ...], tuple[str, ...]],
    rest: tuple[str, ...],
) -> dict[tuple[str, ...], float]:
    """Set -> its share of what a doubted set gives away, whose other names are `rest`."""
    if not rest or frozenset(rest) not in tried:
        return {("unnamed",): 1.0}
    found = {
        names: weight
        for names, weight in weights.items()
        if rests[names] == names and frozenset(rest) <= frozenset(names)
    }
    total = sum(found.values())
    return {names: weight / total for names, weight in found.items()} if total else {rest: 1.0}


RIPPLED = 0.8
"""Share of a leg with a line along its stroke that no name covers: all of four were such (E)."""


def _leaves_a_line(state: Search, chosen: Candidate) -> bool:
    line = stroke_line(state.problem, chosen)
    return line is not None and line.is_shared


def without_a_name(
    weights: Mapping[tuple[str, ...], float], sets: Set[tuple[str, ...]], share: float
) -> dict[tuple[str, ...], float]:
    """The weights with a share of those of some sets given to what no name covers."""
    given = {names: share for names in sets if names != ("unnamed",)}
    out = {names: (1.0 - given.get(names, 0.0)) * weight for names, weight in weights.items()}
    moved = sum(part * weights[names] for names, part in given.items())
    out[("unnamed",)] = weights.get(("unnamed",), 0.0) + moved
    return out


def _with_alike(state: Search, verdict: Verdict) -> dict[str, tuple[str, ...]]:
    """Rivals near in gain, whatever does the same along these motions, another law that its shapes
    may stand for, and of a name whose numbers end at their bounds all that it is known to be taken
    for.
    """
    return {
        name: tuple(
            dict.fromkeys(
                (
                    *rivals,
                    *alike(state, verdict.chosen, name),
                    *other_laws_within(state, verdict.chosen, name),
                    *(_known_rivals(state, name) if name in verdict.at_bounds else ()),
                )
            )
        )
        for name, rivals in verdict.ambiguous.items()
    }


def _known_rivals(state: Search, name: str) -> tuple[str, ...]:
    """What a name is known to be taken for on a rig of this kind."""
    rig = state.problem.base.rig
    return tuple(rival for rival in by_name(name).alike if rig in by_name(rival).rigs)


def decide_on_bench(
    state: Search,
    found: Unexplained,
    proof: Proof,
    goes_with: Mapping[str, float],
    foretold: Callable[[], bool],
) -> Verdict:
    """The verdict on a bench or a drive, of names that passed their trials.

    `goes_with`: channel that rides along -> share by which it lowers what those names leave.
    `foretold`: whether the other runs foretell what is left of each; asked where nothing is named.
    """
    features = bench.signs(state, proof, found, max(goes_with.values(), default=0.0))
    weights = bench.distribution(features, proof.kept.names, bench.calibration())
    weights = bench.with_small(weights, proof.too_small)
    weights = doubted(state.tried, weights)
    verdict = verdict_of(state, weights)
    if verdict.kind == "none" and foretold():
        verdict = verdict_of(state, bench.with_foretold(weights))
    if verdict.kind != "effect":
        return replace(verdict, goes_with=goes_with if verdict.kind == "unnamed" else {})
    return replace(verdict, ambiguous=_with_alike(state, verdict))


def verdict_of(state: Search, weights: Mapping[tuple[str, ...], float]) -> Verdict:
    """The verdict that weights of sets of names make; ("unnamed",) is what no name covers."""
    total = sum(weights.values())
    ranked = sorted(
        ((name, weight / total) for name, weight in weights.items()), key=lambda item: -item[1]
    )
    top = ranked[0][0]
    if top == ("unnamed",):
        return Verdict("unnamed", state.refit, tuple(ranked), {})
    chosen = next(
        candidate
        for candidate in state.tried.values()
        if frozenset(candidate.names) == frozenset(top)
    )
    return Verdict(
        "effect" if top else "none",
        chosen,
        tuple(ranked),
        {name: tuple(near(state, chosen, name)) for name in chosen.names},
        at_bounds=at_bounds(chosen.fit),
    )
