"""What a recording and a motion that was only rehearsed would say together of sets of effects, were
one of the sets true.

The recording is as it is. The rehearsal is the believed machine's: were a set true with the numbers
that the recording gives it, its balances would miss what these effects make by their laws, and
nothing else. Both recordings are one machine's, so numbers that the rehearsal's motion would allow
must fit the recording, too: a spring that could pass for a cushion in either alone cannot in both.
So are its tolerances, and what an earlier recording leaves of them it leaves of them in either: a
weight on board shows only where it is known what the machine weighs.

What both would say is weighed as what a recording says (probabilities.py): whether a sound machine
is told from an effect depends on what every step away from it costs, not on their evidence alone.
Where parts of the recording foretell each other less well than its evidence has it, they still do.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import solve_triangular

from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.groups import Balances
from testbed.diagnosis.robot.hypotheses import Ledger
from testbed.diagnosis.robot.motion_kinds import motion_kinds
from testbed.diagnosis.robot.nonlinear_fit import Fitted, by_whole_laws, fitted, within
from testbed.diagnosis.robot.probabilities import (
    NO_NAME,
    Names,
    RobotSigns,
    calibration,
    distribution,
    has_names,
)
from testbed.diagnosis.robot.second_effects import foretold_alike
from testbed.diagnosis.robot.several_recordings import NOTHING, Changes, of_first, together
from testbed.effects.signature import Change

DRAWS = 8
"""So many numbers that a recording leaves possible are tried of each set, beside the likeliest."""


class ExpectedEvidence:
    """Of one recording, `first`, or several together, and what is asked of it: rival sets of
    effects, each with its probability.
    """

    def __init__(self, first: Ledger, rivals: Mapping[Names, float]) -> None:
        self.rivals = rivals
        self._names = tuple(dict.fromkeys(name for names in rivals for name in names))
        self._first = first.balances
        hypotheses = {names: first.hypothesis(names) for names in rivals}
        held = [first.held(one) for names, one in hypotheses.items() if names]
        self._not_foretold = {
            one.names: hypotheses[one.names].log_factor - one.log_factor
            for one in foretold_alike(first, held)
        }
        self._found = {
            names: tuple(_likely(fitted(first.balances, one))) for names, one in hypotheses.items()
        }

    def chance(self, rehearsed: Balances) -> float:
        """That both recordings would say the true one: the probability that they would give it, in
        the mean over all rivals by how likely each is, and over the numbers that the recording
        leaves possible. What it is already where the motion shows nothing of them.
        """
        both = self._together(rehearsed)
        total = sum(self.rivals.values())
        if not both.raw:
            return sum(chance**2 for chance in self.rivals.values()) / total**2
        told = 0.0
        for true, likely in self.rivals.items():
            said = [self._said(both, rehearsed, one)[true] for one in self._found[true]]
            told += likely / total * float(np.mean(said))
        return told

    def _said(self, both: Balances, rehearsed: Balances, found: Fitted) -> Mapping[Names, float]:
        """The probability that each of the rivals would have beside the others, were one true with
        these numbers.
        """
        before = len(self._first.bodies)
        made = [
            Changes(parts=(*[NOTHING] * before, change)) for change in self._made(rehearsed, found)
        ]
        ledger = Ledger(_missing_also(both, made))
        evidence = [
            (names, by_whole_laws(ledger, ledger.hypothesis(names)) - self._not_foretold[names])
            for names in self.rivals
            if names
        ]
        weights = distribution(RobotSigns(tuple(evidence), {}, motion_kinds(both)), calibration())
        own = {names: weights[names if has_names(names) else NO_NAME] for names in self.rivals}
        total = sum(own.values())
        return {names: weight / total for names, weight in own.items()}

    def _together(self, rehearsed: Balances) -> Balances:
        """The balances of all that show anything of the effects, the rehearsal missing nothing."""
        there = _missing_nothing(_known_beside(rehearsed, self._first.sound))
        recordings = (*(self._first.recordings or (self._first,)), there)
        keys = {key for one in recordings for key in _showing(one, self._names)}
        both = together(*(_of(one, keys, self._names) for one in recordings))
        return replace(both, raw={key: group.factored() for key, group in both.raw.items()})

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


def _showing(balances: Balances, names: Collection[str]) -> Iterator[str]:
    """The groups in which one of these effects shows."""
    for key, group in balances.groups.items():
        if any(name in group.columns for name in names):
            yield key


def _of(balances: Balances, keys: Collection[str], names: Collection[str]) -> Balances:
    """The balances with these groups and candidates alone."""
    candidates = {name: balances.candidates[name] for name in names if name in balances.candidates}
    raw = {key: group for key, group in balances.raw.items() if key in keys}
    return replace(balances, raw=raw, candidates=candidates)


def _known_beside(balances: Balances, sound: Mapping[str, RawGroup]) -> Balances:
    """The same of a machine of which there is an earlier recording."""
    raw = {k: g.knowing(sound[k]) if k in sound else g for k, g in balances.raw.items()}
    return replace(balances, raw=raw)


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
