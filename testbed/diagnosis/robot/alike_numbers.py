"""Numbers that all cylinders have alike: the oil's.

One cylinder's balance may show them wrongly, where a chamber runs nearly empty or hardly anything
flows; the eleven others then say what they are. What is hidden in one cylinder is so held against
the oil of the rest of the machine.

The number of cylinder i is c + APART u, with c ~ N(0, 1) alike and u ~ N(0, 1) its own, in standard
deviations of its tolerance. What each of the others shows of it counts as with Student's t: one
that contradicts the rest says little.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from testbed.diagnosis.robot.evidence import RawGroup
from testbed.formats.arrays import Array

APART = 0.25
"""By so many standard deviations of its tolerance a cylinder's own oil differs from the others':
air that was not bled from one of them (E).
"""
COMMON = 0.6
"""So much of what one cylinder leaves unknown, as a standard deviation, may be wrong in all alike:
a drill shakes every chamber (E).
"""
FREEDOM, ROUNDS = 4.0, 20
"""Degrees of freedom of Student's t (E), and rounds in which it is weighed anew."""
LEAST_SHOWN = 1e-6
"""Information below which a cylinder says nothing of a number."""

Groups = Mapping[str, RawGroup]


def told_by_others(groups: Groups) -> dict[str, RawGroup]:
    """The groups, each told what the others of them show of the numbers that all have alike."""
    by_number: dict[str, dict[str, tuple[float, float]]] = {}
    for key, group in groups.items():
        if group.alike:
            mean, covariance = group.tolerances_shown()
            for number, k in group.alike.items():
                seen = _shown(float(mean[k]), float(covariance[k, k]))
                by_number.setdefault(number, {})[key] = seen
    return {
        key: replace(group, told={n: _consensus(by_number[n], key) for n in group.alike})
        for key, group in groups.items()
    }


def _shown(mean: float, variance: float) -> tuple[float, float]:
    """Value and information of a number by a recording alone, of its mean and variance beside what
    its tolerance says.
    """
    information = max(1.0 / variance - 1.0, LEAST_SHOWN)
    return mean / variance / information, information


def _consensus(shown: Mapping[str, tuple[float, float]], but: str) -> tuple[float, float]:
    """Mean and standard deviation of a number in the group `but`, by all others."""
    others = np.array([seen for key, seen in shown.items() if key != but]).reshape(-1, 2)
    value, variance = others[:, 0], APART**2 + 1.0 / others[:, 1]
    weight = 1.0 / variance
    middle = _weighted_median(value, weight)
    for _ in range(ROUNDS):
        off = (value - middle) ** 2 / variance
        weight = (FREEDOM + 1.0) / (FREEDOM + off) / variance
        middle = float(weight @ value / (1.0 + weight.sum()))
    alike = COMMON**2 * float(np.median(1.0 / others[:, 1])) if len(others) else 0.0
    known_to = max(1.0 / (1.0 + weight.sum()), alike / (1.0 + alike))
    return middle, float(np.sqrt(APART**2 + known_to))


def _weighted_median(value: Array, weight: Array) -> float:
    """The value at which half of the weight lies below; 0 of no values."""
    if not len(value):
        return 0.0
    order = np.argsort(value)
    half = np.searchsorted(np.cumsum(weight[order]), 0.5 * weight.sum())
    return float(value[order][half])
