"""The last part of a recording, which effects that were found must predict: how well they do, and
whether the forces that are estimated may be corrected for them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from testbed.diagnosis.robot.evidence import RawGroup
from testbed.effects.signature import Signature
from testbed.formats.arrays import Array

LEARNT_SHARE = 0.65
"""Share of a run that is learnt from; the rest is kept back and predicted."""
ALIKE = 1.02
"""Two errors on the kept-back forces whose ratio is below this count as equal, as for single legs
(E).
"""
HARDLY_WORSE = 0.05
"""What effects add to the error of the kept-back forces (root of the difference of squares) is
little below this share of what the machine as believed misses there (E).
"""
FEWEST_S, SURE = 4, 1.645
"""Fewest seconds that tell a spread, and how many of its deviations are sure with 95 % (E)."""


@dataclass(frozen=True, eq=False)
class KeptBack:
    """How well a group's kept-back part is predicted, with effects and without."""

    errors: Mapping[str, float]
    """RMS residual as believed (`before`), with the tolerances refitted (`refit`), and with the
    effects as well (`after`).
    """
    added_each_second: Array
    """By how much the effects add to the mean square error beside what the tolerances of a sound
    machine leave, second by second.
    """


def kept_back(group: RawGroup, effects: Sequence[Signature]) -> KeptBack:
    """How well a group's kept-back part is predicted by effects, whose signatures are scaled to a
    prior of 1.
    """
    until = _until(group)
    kept = group.time_s >= until
    alone, beside = group.left_unpredicted(until, effects)
    errors = {
        stage: group.size(rest, kept)
        for stage, rest in (
            ("before", group.missing[kept]),
            ("refit", alone),
            ("after", beside),
        )
    }
    time = group.time_s[kept]
    second = np.unique((time - time.min()) // 1.0, return_inverse=True)[1]
    return KeptBack(errors, np.bincount(second, beside**2 - alone**2) / np.bincount(second))


def predicts(error: Mapping[str, float], added_n2: Array) -> bool:
    """Whether effects predict kept-back forces about as well as the tolerances of a sound machine
    do, or better; or hardly worse beside all that is missing without either; or not surely worse,
    by how much its seconds differ.
    """
    added = error["after"] ** 2 - error["refit"] ** 2
    little = added <= (HARDLY_WORSE * error["before"]) ** 2
    alike = error["after"] <= error["refit"] * ALIKE
    return little or alike or not surely_more(added_n2)


def surely_more(added: Array) -> bool:
    """Whether numbers (k,) of which each comes from a second of its own are more than nothing in
    the mean, with 95 %; of too few nobody knows, and they count.
    """
    if len(added) < FEWEST_S:
        return True
    return float(np.mean(added)) > SURE * float(np.std(added, ddof=1)) / math.sqrt(len(added))


def _until(group: RawGroup) -> float:
    """Start of the part that is kept back, s."""
    first, last = float(group.time_s.min()), float(group.time_s.max())
    return first + LEARNT_SHARE * (last - first)
