"""What a name must pass before it is said, and what becomes of its probability if it fails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from testbed.diagnosis.robot.hypotheses import Hypothesis, Ledger
from testbed.diagnosis.robot.parameters import Doubt, Found
from testbed.diagnosis.robot.probabilities import Names

LEAST_FORESEEN = 2.0
"""Least gain in log likelihood of the kept-back parts by an effect (E)."""
LEAST_WALD = 2.7
"""1.645 squared: the 90 % interval of a single number excludes zero."""
CONTAINS_ZERO = "its interval contains zero"
NOT_FORESEEN = "parts of the recording that were kept back are predicted no better with it"


def failed_names(ledger: Ledger, chosen: Hypothesis, found: Sequence[Found]) -> dict[str, str]:
    """Names of the chosen set that fail a test, with the reason; `found`: its parameters."""
    width = Doubt.shipped().width
    sizeless = {one.name for one in found if one.may_be_nothing}
    out, first = {}, 0
    for name in chosen.names:
        size = len(ledger.balances.candidates[name].signature)
        own = slice(first, first + size)
        first += size
        mean, inside = chosen.mean[own], chosen.covariance[own, own] * width**2
        if float(mean @ np.linalg.solve(inside, mean)) < LEAST_WALD * np.sqrt(size):
            out[name] = CONTAINS_ZERO
            continue
        if name in sizeless and size == 1:
            out[name] = CONTAINS_ZERO
            continue
        others = tuple(n for n in chosen.names if n != name)
        if ledger.is_course(name):
            continue
        if ledger.foreseen(chosen.names) - ledger.foreseen(others) < LEAST_FORESEEN:
            out[name] = NOT_FORESEEN
    return out


def without(weights: Mapping[Names, float], failed: Mapping[str, str]) -> dict[Names, float]:
    """The weights, with those of sets that contain a failed name moved to the sets without it."""
    out: dict[Names, float] = {}
    for names, weight in weights.items():
        left = tuple(n for n in names if n not in failed)
        left = left if left in weights else ()
        out[left] = out.get(left, 0.0) + weight
    return out
