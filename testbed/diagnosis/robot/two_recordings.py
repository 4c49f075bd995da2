"""Two recordings of one machine as one set of balances: what is the same in both must explain both.

Rows of the second follow those of the first. An effect's numbers and a sound machine's tolerances
are those of the machine, so they are shared; noise is not, and neither is a course in time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.groups import Balances, Candidate
from testbed.effects.signature import Change

Array = npt.NDArray[np.float64]
APART_S = 100.0
"""Time between the recordings, as far as anything that fades with time is concerned."""
NOTHING = Change()


@dataclass(frozen=True, eq=False)
class Changes(Change):
    """What one unit of a number does to each of two recordings."""

    parts: tuple[Change, Change] = (NOTHING, NOTHING)

    def times(self, factor: float) -> Changes:
        """The changes by so many units."""
        first, second = (part.times(factor) for part in self.parts)
        return Changes(parts=(first, second))


def together(first: Balances, second: Balances) -> Balances:
    """The balances that both have; bins and body are those of the first."""
    shared = [name for name in first.candidates if name in second.candidates]
    if any(first.candidates[name].effect.by_travel for name in shared):
        first, second = _by_same_travel(first, second)
    candidates = {n: _candidate(first.candidates[n], second.candidates[n]) for n in shared}
    raw = {k: _group(g, second.raw[k]) for k, g in first.raw.items() if k in second.raw}
    signatures = {name: candidate.signature for name, candidate in candidates.items()}
    groups = {key: group.whitened(signatures) for key, group in raw.items()}
    return Balances(first.bins, first.body, raw, groups, candidates, second.body, first.sound)


def _by_same_travel(*both: Balances) -> tuple[Balances, Balances]:
    """Both with signatures whose numbers mean the same in either: a cushion begins at the same
    places of the travel of both.
    """
    extension = np.vstack([one.body.seen.extension_m for one in both])
    visited = np.array([extension.min(axis=0), extension.max(axis=0)])
    first, second = (_visiting(one, visited) for one in both)
    return first, second


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


def _candidate(one: Candidate, other: Candidate) -> Candidate:
    """The effect with what it does to both; the numbers of a course in time are each recording's
    own.
    """
    signature: dict[str, Change] = {}
    if one.is_course:
        signature |= {k: Changes(parts=(change, NOTHING)) for k, change in one.signature.items()}
        signature |= {
            f"{AGAIN}{k}": Changes(parts=(NOTHING, change)) for k, change in other.signature.items()
        }
    else:
        signature |= {
            k: Changes(parts=(change, other.signature[k])) for k, change in one.signature.items()
        }
    price = one.price + other.price
    return Candidate(one.effect, one.place, signature, one.scale, price=price)


AGAIN = "again "
"""Before the numbers of a course in the second recording."""


def _group(one: RawGroup, other: RawGroup) -> RawGroup:
    rows = (len(one.missing), len(other.missing))
    noise = np.zeros((sum(rows), sum(rows)))
    noise[: rows[0], : rows[0]], noise[rows[0] :, rows[0] :] = one.noise, other.noise
    return RawGroup(
        missing=np.concatenate([one.missing, other.missing]),
        time_s=np.concatenate([one.time_s, other.time_s + APART_S]),
        noise=noise,
        tolerated=np.vstack([one.tolerated, other.tolerated]),
        rows_of=lambda change: _rows(one, other, change),
        of_first=rows[0],
    )


def _rows(one: RawGroup, other: RawGroup, change: Change) -> Array:
    assert isinstance(change, Changes)
    return np.concatenate([one.rows_of(change.parts[0]), other.rows_of(change.parts[1])])


def of_first(numbers: Mapping[str, float]) -> dict[str, float]:
    """An effect's numbers without those of a course in the second recording."""
    return {k: value for k, value in numbers.items() if not k.startswith(AGAIN)}
