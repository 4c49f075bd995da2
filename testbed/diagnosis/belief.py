"""From signs to a distribution over sets of names, for legs whose sensors and valve are declared.

Three questions, each a logistic regression on a few signs, and rivalry among sets of the same size:

    P(no name covers it) = L(outside)
    P(an effect | a name would cover it) = L(presence),   P(a second one | an effect) = L(second)
    P(this set | its size) ~ (1 + (behind the leader) / (slack + share * leader's gain)) ^ -power

The last falls as a power, not exponentially: the noise's model is not exact, and a leader far ahead may still be the
wrong name for a law of another form. The numbers are in `calibration.yaml`, with the rigs they were fitted on;
`python -m testbed.evaluation.diagnosis_calibration` fits them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from testbed.diagnosis.signs import Signs

FILE = Path(__file__).with_name("calibration.yaml")
Names = tuple[str, ...]


@dataclass(frozen=True)
class Calibration:
    """Question -> sign -> weight; and `rivals`: slack, share, power for single effects, power for larger sets."""

    outside: Mapping[str, float]
    presence: Mapping[str, float]
    second: Mapping[str, float]
    rivals: Mapping[str, float]


@cache
def calibration() -> Calibration:
    """The numbers that this version ships."""
    import yaml

    row = yaml.safe_load(FILE.read_text())
    return Calibration(row["outside"], row["presence"], row["second"], row["rivals"])


def _log(value: float, least: float) -> float:
    return float(np.log(max(value, least)))


def _size(value: float) -> float:
    """A logarithm for numbers of either sign, straight near 0."""
    return float(np.arcsinh(value / 5.0))


def presence_signs(s: Signs) -> dict[str, float]:
    """What tells whether there is an effect at all."""
    f = s.first or s.refit
    return {"one": 1.0, "gain": _log(f.gain, 0.5), "fall": _log(f.fall, 1e-3), "carried": _size(f.carried)}


def second_signs(s: Signs) -> dict[str, float]:
    """What tells whether there is a second effect beside the first.

    What a strong first effect's own formula leaves over looks like a small second one: hence the first one's gain, and
    what is left even with the second.
    """
    first, second = s.first or s.refit, s.second or s.refit
    return {
        "one": 1.0, "more": _log(second.more, 0.5), "fall": _log(second.fall, 1e-3), "carried": _size(second.carried),
        "first": _log(first.gain, 0.5), "left": _log(max(second.force, second.flow), 1.0),
        "worst": _log(1.0 + min(second.worst, 2.0), 1.0),
    }  # fmt: skip


def outside_signs(s: Signs) -> dict[str, float]:
    """What tells that no name covers what is there: what is left, what was closed, what generic terms still find."""
    best = s.best
    return {
        "one": 1.0, "force": _log(best.force, 1.0), "flow": _log(best.flow, 1.0),
        "closed_force": _log(s.refit.force / best.force, 1e-3), "closed_flow": _log(s.refit.flow / best.flow, 1e-3),
        "generic": _log(s.generic_gain, 0.5), "generic_fall": _log(s.generic_fall, 1e-3), "gain": _log(best.gain, 0.5),
    }  # fmt: skip


def _answer(signs: Mapping[str, float], weights: Mapping[str, float]) -> float:
    total = sum(weights[k] * v for k, v in signs.items() if k in weights)
    return float(1.0 / (1.0 + np.exp(-np.clip(total, -30.0, 30.0))))


def distribution(s: Signs, c: Calibration) -> dict[Names, float]:
    """Set of names -> probability, adding up to 1; the empty set is `none`, ("unnamed",) what no name covers."""
    missing = _answer(outside_signs(s), c.outside)
    singles = [(n, g) for n, g in s.gains if len(n) == 1]
    larger = [(n, g) for n, g in s.gains if len(n) > 1]
    some = _answer(presence_signs(s), c.presence) if singles else 0.0
    two = _answer(second_signs(s), c.second) if larger else 0.0
    out: dict[Names, float] = {("unnamed",): missing, (): (1.0 - missing) * (1.0 - some)}
    for group, power, whole in (
        (singles, c.rivals["power_1"], some * (1.0 - two)),
        (larger, c.rivals["power_2"], some * two),
    ):
        for names, share in _rivalry(group, c.rivals["slack"], c.rivals["share"], power):
            out[names] = out.get(names, 0.0) + (1.0 - missing) * whole * share
    return out


def _rivalry(
    group: Sequence[tuple[Names, float]], slack: float, share: float, power: float
) -> list[tuple[Names, float]]:
    if not group:
        return []
    gains = np.array([g for _, g in group])
    behind = (gains.max() - gains) / (slack + share * max(float(gains.max()), 0.0))
    belief = (1.0 + behind) ** -power
    return [(n, float(b)) for (n, _), b in zip(group, belief / belief.sum(), strict=True)]
