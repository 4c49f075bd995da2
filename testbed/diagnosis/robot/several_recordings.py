"""Several recordings of one machine as one set of balances: what is the same in all must explain
all of them.

Rows of one recording follow those of the one before. An effect's numbers and a sound machine's
tolerances are those of the machine, so they are shared; noise is not, and neither is a course in
time. The first recording is the one that is asked about: what it cannot show has no signature here,
and what a further one cannot show makes nothing there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag

from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.groups import Balances, Candidate
from testbed.effects.signature import Change

Array = npt.NDArray[np.float64]
APART_S = 100.0
"""Time between recordings, as far as anything that fades with time is concerned."""
NOTHING = Change()


@dataclass(frozen=True, eq=False)
class Changes(Change):
    """What one unit of a number does to each of several recordings."""

    parts: tuple[Change, ...] = ()

    def times(self, factor: float) -> Changes:
        """The changes by so many units."""
        return Changes(parts=tuple(part.times(factor) for part in self.parts))


def together(*recordings: Balances) -> Balances:
    """The balances of all; bins, body and candidates are those of the first. One that is several
    already counts as those.
    """
    all_of_them = [one for balances in recordings for one in (balances.recordings or (balances,))]
    if len(all_of_them) == 1:
        return all_of_them[0]
    if any(candidate.effect.by_travel for candidate in all_of_them[0].candidates.values()):
        all_of_them = _by_same_travel(all_of_them)
    first, *others = all_of_them
    candidates = {name: _candidate(name, all_of_them) for name in first.candidates}
    keys = dict.fromkeys(key for one in all_of_them for key in one.raw)
    raw = {key: _group([one.raw.get(key) for one in all_of_them]) for key in keys}
    signatures = {name: candidate.signature for name, candidate in candidates.items()}
    return replace(
        first,
        raw=raw,
        groups={key: group.whitened(signatures) for key, group in raw.items()},
        candidates=candidates,
        others=tuple(one.body for one in others),
        recordings=tuple(all_of_them),
    )


def _by_same_travel(recordings: Sequence[Balances]) -> list[Balances]:
    """Recordings with signatures whose numbers mean the same in each: a cushion begins at the same
    places of the travel of all.
    """
    extension = np.vstack([one.body.seen.extension_m for one in recordings])
    visited = np.array([extension.min(axis=0), extension.max(axis=0)])
    return [_visiting(one, visited) for one in recordings]


def _visiting(balances: Balances, visited_m: Array) -> Balances:
    """The balances of one of several recordings in which pistons went between these (2, 12)."""
    body = replace(balances.body, seen=replace(balances.body.seen, visited_m=visited_m))
    candidates = {
        name: replace(one, signature=one.effect.signature(body.seen, one.place))
        if one.effect.by_travel
        else one
        for name, one in balances.candidates.items()
    }
    return replace(balances, body=body, candidates=candidates)


def _candidate(name: str, recordings: Sequence[Balances]) -> Candidate:
    """The effect with what it does to each; the numbers of a course in time are each recording's
    own.
    """
    shown = [one.candidates.get(name) for one in recordings]
    first = recordings[0].candidates[name]
    signature: dict[str, Change] = {}
    if first.is_course:
        for k, candidate in enumerate(shown):
            if candidate is not None:
                for number, change in candidate.signature.items():
                    parts = [NOTHING] * len(shown)
                    parts[k] = change
                    signature[AGAIN * k + number] = Changes(parts=tuple(parts))
    else:
        for number in first.signature:
            signature[number] = Changes(
                parts=tuple(
                    NOTHING if candidate is None else candidate.signature.get(number, NOTHING)
                    for candidate in shown
                )
            )
    price = sum(candidate.price for candidate in shown if candidate is not None)
    return Candidate(first.effect, first.place, signature, first.scale, price=price)


AGAIN = "again "
"""Before the numbers of a course in a further recording, once for each before it."""


def _group(groups: Sequence[RawGroup | None]) -> RawGroup:
    """One group of balances of several recordings; None: of one that has no such rows."""
    there = [(k, group) for k, group in enumerate(groups) if group is not None]

    def rows_of(change: Change) -> Array:
        assert isinstance(change, Changes)
        return np.concatenate([group.rows_of(change.parts[k]) for k, group in there])

    return RawGroup(
        missing=np.concatenate([group.missing for _, group in there]),
        time_s=np.concatenate([group.time_s + k * APART_S for k, group in there]),
        noise=block_diag(*(group.noise for _, group in there)),
        tolerated=np.vstack([group.tolerated for _, group in there]),
        rows_of=rows_of,
        of_first=0 if groups[0] is None else len(groups[0].missing),
    )


def of_first(numbers: Mapping[str, float]) -> dict[str, float]:
    """An effect's numbers without those of a course in a further recording."""
    return {k: value for k, value in numbers.items() if not k.startswith(AGAIN)}
