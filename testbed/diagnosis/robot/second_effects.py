"""Of two recordings of one machine: whether each of them shows a second effect.

What a model is wrong about in one motion looks like a second effect beside a right one. An effect
of the machine is there in both recordings, so it counts as a second one only where both are
predicted better with it, by the same numbers. What one of them alone shows is named alone or not at
all.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from testbed.diagnosis.robot.groups import Balances
from testbed.diagnosis.robot.hypotheses import Hypothesis, Ledger
from testbed.formats.arrays import Array

LEAST_RAISED = 2.0
"""Least ln of the likelihood by which a second effect predicts each recording better (E)."""


def shown_by_both(ledger: Ledger, tried: Iterable[Hypothesis]) -> list[Hypothesis]:
    """The hypotheses of a search; of two recordings a pair of which one effect is not shown by both
    has no more evidence than the other one alone. Singles first, the best of each first.
    """
    found = list(tried)
    if ledger.balances.second is None:
        return found
    alone = {one.names[0]: one.log_factor for one in found if len(one.names) == 1}
    found = [_as_shown(ledger, one, alone) if len(one.names) == 2 else one for one in found]
    return sorted(found, key=lambda one: (len(one.names), -one.log_factor))


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
