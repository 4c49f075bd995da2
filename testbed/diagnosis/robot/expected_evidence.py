"""What a recording and a motion that was only rehearsed would say together of sets of effects, were
one of the sets true.

The recording is as it is. The rehearsal is the believed machine's: were a set true with the numbers
that the recording gives it, its balances would miss what these effects make by their laws, and
nothing else. Both recordings are one machine's, so numbers that the rehearsal's motion would allow
must fit the recording, too: a spring that could pass for a cushion in either alone cannot in both.
So are its tolerances, and what an earlier recording leaves of them it leaves of them in either: a
weight on board shows only where it is known what the machine weighs. Where the recording is two
already, the rehearsal is looked at by itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import expit

from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.groups import Balances, Candidate
from testbed.diagnosis.robot.hypotheses import Ledger
from testbed.diagnosis.robot.nonlinear_fit import Fitted, by_whole_laws, fitted, within
from testbed.diagnosis.robot.probabilities import Names, calibration, tempered
from testbed.diagnosis.robot.two_recordings import NOTHING, Changes, of_first, together
from testbed.effects.signature import Change

DRAWS = 8
"""So many numbers that a recording leaves possible are tried of each set, beside the likeliest."""


class ExpectedEvidence:
    """Of one recording, `first`, and what is asked of it: rival sets of effects, each with its
    probability.
    """

    def __init__(self, first: Ledger, rivals: Mapping[Names, float]) -> None:
        self.rivals = rivals
        self._names = tuple(dict.fromkeys(name for names in rivals for name in names))
        self._first = first.balances
        self._found = {
            names: tuple(_likely(fitted(first.balances, first.hypothesis(names))))
            for names in rivals
        }

    def chance(self, rehearsed: Balances) -> float:
        """That both recordings would tell a true one of them from a false one, 0.5 where the motion
        says nothing: how sure their evidence would be of the true one, in the mean over all pairs
        by how likely both are, and over the numbers that the recording leaves possible.
        """
        both = self._together(rehearsed)
        if not both.raw:
            return 0.5
        told, weight = 0.0, 0.0
        for true, likely in self.rivals.items():
            for one in self._found[true]:
                evidence = self._evidence(both, rehearsed, one)
                for other, chance in self.rivals.items():
                    if other != true:
                        share = likely * chance / len(self._found[true])
                        told += share * sureness(evidence[true] - evidence[other])
                        weight += share
        return told / weight

    def _evidence(
        self, both: Balances, rehearsed: Balances, found: Fitted
    ) -> Mapping[Names, float]:
        """The evidence that each of the rivals would have, were one true with these numbers."""
        made = list(self._made(rehearsed, found))
        if self._first.second is None:
            made = [Changes(parts=(NOTHING, change)) for change in made]
        ledger = Ledger(_missing_also(both, made))
        return {names: by_whole_laws(ledger, ledger.hypothesis(names)) for names in self.rivals}

    def _together(self, rehearsed: Balances) -> Balances:
        """The balances of both that show anything of the effects, the rehearsal missing nothing."""
        there = {name: self._candidate(name, rehearsed) for name in self._names}
        here = {name: self._first.candidates[name] for name in self._names}
        first = _showing(self._first, rehearsed, here)
        known = _known_beside(_showing(rehearsed, self._first, there), self._first.sound)
        second = _missing_nothing(known)
        both = second if self._first.second is not None else together(first, second)
        return replace(both, raw={key: group.factored() for key, group in both.raw.items()})

    def _candidate(self, name: str, rehearsed: Balances) -> Candidate:
        """An effect in the rehearsal; one that shows nothing there makes nothing."""
        own = self._first.candidates[name]
        nothing = {number: NOTHING for number in own.signature}
        return rehearsed.candidates.get(name, replace(own, signature=nothing))

    def _made(self, rehearsed: Balances, found: Fitted) -> Iterator[Change]:
        """What effects make in the rehearsal: by the laws of those that bend; of a course in time,
        which is another each time, as much as both have.
        """
        for part in found.parts:
            name = part.candidate.name
            there = rehearsed.candidates.get(name)
            if there is None:
                continue
            if part.coordinates:
                values = found.parameters(part, found.mean, self._first)
                yield there.effect.made(rehearsed.body.seen, there.place, values)
                continue
            numbers = dict(
                zip(part.candidate.signature, part.own(found.mean).tolist(), strict=True)
            )
            for number, value in of_first(numbers).items():
                if number in there.signature:
                    yield there.signature[number].times(value)


def _likely(found: Fitted) -> Iterator[Fitted]:
    """The likeliest numbers of a set, and DRAWS of those that are possible, the same each time."""
    yield found
    if not any(part.coordinates for part in found.parts):
        return  # evidence goes with the square of what is linear: the mean says enough
    root = np.linalg.cholesky(found.covariance)
    for drawn in np.random.default_rng(DRAWS).standard_normal((DRAWS, len(found.mean))):
        yield replace(found, mean=within(found.parts, found.mean + root @ drawn))


def _showing(balances: Balances, other: Balances, candidates: Mapping[str, Candidate]) -> Balances:
    """The balances with these candidates, of the groups in which one of them shows in either."""

    def shows(key: str) -> bool:
        groups = (one.groups.get(key) for one in (balances, other))
        return any(name in group.columns for group in groups if group for name in candidates)

    raw = {key: group for key, group in balances.raw.items() if shows(key)}
    groups = {key: group for key, group in balances.groups.items() if key in raw}
    return replace(balances, raw=raw, groups=groups, candidates=candidates)


def _known_beside(balances: Balances, sound: Mapping[str, RawGroup]) -> Balances:
    """The same of a machine of which there is an earlier recording."""
    raw = {k: g.knowing(sound[k]) if k in sound else g for k, g in balances.raw.items()}
    return replace(balances, raw=raw)


def sureness(gap: float) -> float:
    """Probability of the better of two sets by a gap in their evidence, of either sign: ten times
    the evidence is not ten times as sure, see probabilities.tempered.
    """
    numbers = calibration()
    counted = float(tempered(np.array(abs(gap)), float(numbers["much"])))
    return float(expit(math.copysign(float(numbers["share"]) * counted, gap)))


def _missing_nothing(balances: Balances) -> Balances:
    """The same, were nothing missing."""
    raw = {k: replace(g, missing=np.zeros(len(g.missing))) for k, g in balances.raw.items()}
    return replace(balances, raw=raw)


def _missing_also(balances: Balances, changes: Sequence[Change]) -> Balances:
    """The same, were what these changes make missing besides."""
    raw, groups = {}, {}
    for key, group in balances.raw.items():
        rows = [group.rows_of(change) for change in changes]
        raw[key] = replace(group, missing=np.sum([group.missing, *rows], axis=0))
        white = solve_triangular(group.root(), raw[key].missing, lower=True)
        groups[key] = replace(balances.groups[key], missing=white)
    return replace(balances, raw=raw, groups=groups)
