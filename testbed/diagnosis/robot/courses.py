"""Which of its courses in time an effect takes: some go on at times and by amounts that nobody
knows beforehand, as a foot that slips.

Such an effect has several signatures (`Effect.courses`). The one with most evidence is kept, and
costs what it is worth to pick one of so many.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from testbed.diagnosis.robot.evidence import Whitened
from testbed.diagnosis.robot.groups import Balances, Candidate
from testbed.diagnosis.robot.held_out_parts import log_evidence


@dataclass(frozen=True, eq=False)
class Taken:
    """A candidate that takes one of its courses, by one of its sizes."""

    candidate: Candidate
    label: str
    size: float

    def evidence(self, shown: Sequence[Whitened]) -> float:
        """Ln of its Bayes factor alone against a sound machine, less its price."""
        width = self.size * self.candidate.spreads
        whole, gradient = np.eye(len(width)), np.zeros(len(width))
        for group in shown:
            if self.label in group.columns:
                columns = width * group.columns[self.label]
                whole += columns.T @ columns
                gradient += columns.T @ group.missing
        return log_evidence(whole, gradient) - self.candidate.price

    def sized(self) -> Candidate:
        """The candidate with its numbers as shares of that size."""
        signature = self.candidate.signature
        return replace(
            self.candidate, signature={k: one.times(self.size) for k, one in signature.items()}
        )


def with_likeliest_courses(balances: Balances) -> Balances:
    """The balances with the likeliest course of every effect that has several."""
    candidates, groups = dict(balances.candidates), dict(balances.groups)
    several = {n: tuple(_courses(one)) for n, one in candidates.items() if len(one.courses) > 1}
    tried = {one.label: one.candidate.signature for taken in several.values() for one in taken}
    shown = {
        key: balances.raw[key].whitened(tried)
        for key, group in groups.items()
        if several.keys() & group.columns.keys()
    }
    for name, taken in several.items():
        best = max(taken, key=lambda one: one.evidence(tuple(shown.values())))
        candidates[name] = best.sized()
        for key, group in shown.items():
            columns = {k: found for k, found in groups[key].columns.items() if k != name}
            if best.label in group.columns:
                columns[name] = best.size * group.columns[best.label]
            groups[key] = replace(groups[key], columns=columns)
    return replace(balances, candidates=candidates, groups=groups)


def _courses(candidate: Candidate) -> Iterator[Taken]:
    """Every course of a candidate by every size."""
    picked = math.log(sum(len(course.sizes) for course in candidate.courses))
    for k, course in enumerate(candidate.courses):
        price = picked + course.price
        taking = replace(candidate, signature=course.signature, price=price)
        for size in course.sizes:
            yield Taken(taking, f"{candidate.name} {k}", size)
