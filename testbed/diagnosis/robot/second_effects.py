"""Of two recordings of one machine: what each of them shows of an effect.

What a model is wrong about in one motion looks like an effect there. The second recording is made
to decide between what the first one shows, so an effect that the first does not show is none that
was asked for. A second effect beside a right one counts only where both recordings are predicted
better with it, by the same numbers.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from testbed.diagnosis.robot.groups import Balances
from testbed.diagnosis.robot.hypotheses import Hypothesis, Ledger
from testbed.formats.arrays import Array

LEAST_RAISED = 2.0
"""Least ln of the likelihood by which an effect predicts a recording better that shows it (E)."""
ALIKE, NEARLY_AS_MUCH = 0.9, 3.0
"""Two effects make nearly the same where the cosine between what both make of the balances is
larger, and explain nearly as much where their ln of the evidence differs by less (E).
"""


def foretold_alike(ledger: Ledger, tried: Iterable[Hypothesis]) -> list[Hypothesis]:
    """The hypotheses of a search, singles first, the best of each first; of several recordings
    single effects with as much of their evidence as their likes have.

    Of two that make nearly the same, and explain nearly as much, parts that are kept back foretell
    the one no better than the other: what lies in one part alone is no reason to prefer either.
    """
    found = list(tried)
    if not ledger.balances.others:
        return found
    singles = [one for one in found if len(one.names) == 1]
    whole = [ledger.hypothesis(one.names) for one in singles]
    missed = [of.log_factor - one.log_factor for of, one in zip(whole, singles, strict=True)]
    out = []
    for one, of, own in zip(singles, whole, missed, strict=True):
        likes = [
            other
            for like, other in zip(whole, missed, strict=True)
            if other < own
            and like.log_factor > of.log_factor - NEARLY_AS_MUCH
            and ledger.likeness(of, like) > ALIKE
        ]
        out.append(replace(one, log_factor=one.log_factor + own - min(likes, default=own)))
    pairs = [one for one in found if len(one.names) == 2]
    return [*sorted(out, key=lambda h: -h.log_factor), *pairs]


def shown_by_both(ledger: Ledger, tried: Iterable[Hypothesis]) -> list[Hypothesis]:
    """The hypotheses of a search; of two recordings an effect that the first does not show has no
    evidence, and a pair of which one effect is not shown by both has no more than the other one
    alone. Singles first, the best of each first.
    """
    found = list(tried)
    if not ledger.balances.others:
        return found
    singles = [_as_asked(ledger, one) for one in found if len(one.names) == 1]
    alone = {one.names[0]: one.log_factor for one in singles}
    pairs = [_as_shown(ledger, one, alone) for one in found if len(one.names) == 2]
    return [one for size in (singles, pairs) for one in sorted(size, key=lambda h: -h.log_factor)]


def _as_asked(ledger: Ledger, single: Hypothesis) -> Hypothesis:
    shown = explained(ledger.balances, ledger.hypothesis(single.names))[0] >= LEAST_RAISED
    return single if shown else replace(single, log_factor=min(single.log_factor, 0.0))


def _as_shown(ledger: Ledger, pair: Hypothesis, alone: Mapping[str, float]) -> Hypothesis:
    beside = explained(ledger.balances, ledger.hypothesis(pair.names))
    most = pair.log_factor
    for name, other in (pair.names, pair.names[::-1]):
        own = ledger.hypothesis((other,))
        raised = beside - explained(ledger.balances, own)
        if raised.min() < LEAST_RAISED and not ledger.is_course(name):
            most = min(most, alone.get(other, own.log_factor))
    return replace(pair, log_factor=most)


def explained(balances: Balances, one: Hypothesis) -> Array:
    """(2,) ln of the likelihood of each of two recordings by a hypothesis with its likeliest
    numbers, beside that of a sound machine; of the second by what the first says of its tolerances.
    """
    out = np.zeros(2)
    for key, group in balances.groups.items():
        made, first = np.zeros(len(group.missing)), 0
        for name in one.names:
            size = len(balances.candidates[name].signature)
            if name in group.columns:
                made += group.columns[name] @ one.mean[first : first + size]
            first += size
        rows = made * (group.missing - 0.5 * made)
        until = balances.raw[key].of_first
        out += rows[:until].sum(), rows[until:].sum()
    return out
