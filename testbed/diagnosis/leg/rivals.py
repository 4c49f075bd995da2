"""Names that this data cannot distinguish from a chosen one, and how much is believed of each."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from testbed.diagnosis.leg.indistinguishable import alike
from testbed.diagnosis.leg.search import Candidate, Search

Names = frozenset[str]
TEMPERATURE = {"vertical-leg": 8.0, "cylinder": 8.0, "drive": 8.0, "robot": 2.5}
"""Log-likelihood that counts as one unit of belief between rival sets: the noise's model is not
exact.
"""
AMBIGUOUS = 3.0
"""A rival within so many units of belief of the chosen name is reported as not distinguished."""


def near(state: Search, chosen: Candidate, name: str) -> dict[str, float]:
    """The names that could stand in the place of one name of a set within AMBIGUOUS units of
    belief -> by how many units they are behind it, the nearest first.
    """
    unit = TEMPERATURE[state.problem.kind]
    rest = frozenset(chosen.names) - {name}
    behind = {
        next(iter(names - rest)): (state.gain(chosen) - state.gain(candidate)) / unit
        for names, candidate in state.tried.items()
        if len(names) == len(chosen.names) and rest < names and name not in names
    }
    ranked = sorted(behind.items(), key=lambda item: item[1])
    return {rival: units for rival, units in ranked if units < AMBIGUOUS}


def untold(state: Search, chosen: Candidate, name: str) -> dict[str, float]:
    """Of these the names that also do the same along these motions: what tells one of them from
    the other is no more than how their laws happen to fit the noise.
    """
    found = near(state, chosen, name)
    same = alike(state, chosen, name) if found else ()
    return {rival: units for rival, units in found.items() if rival in same}


def exchanged(state: Search, chosen: Candidate) -> dict[Names, float]:
    """The sets with one name of the chosen one exchanged for one that it is not distinguished
    from -> what is believed of them for one of the chosen set, at most 1.
    """
    out: dict[Names, float] = {}
    for name in chosen.names:
        for rival, units in untold(state, chosen, name).items():
            names = (frozenset(chosen.names) - {name}) | {rival}
            out[names] = float(np.exp(-max(units, 0.0)))
    return out


def share_of(name: str, rivals: Collection[str], won: Mapping[Names, float]) -> float:
    """Share of the bootstrap's draws whose best set holds a name, or one of its rivals."""
    held = {name, *rivals}
    return sum(share for names, share in won.items() if held & names)
