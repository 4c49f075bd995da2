"""From signs to a distribution over sets of names, for the legs of the whole robot.

As for single legs (`diagnosis/leg/probabilities.py`), with fewer signs: expected loads and the other legs stand in for
a load cell.

    P(no name covers it) = L(strange)
    P(an effect | a name would cover it) = L(presence),   P(a second one | an effect) = L(second)

and rivalry among sets of one size falls as a power of how far a set is behind. The numbers are in
`calibration.yaml`; `testbed lab fit-robot-diagnosis` fits them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from testbed.diagnosis.leg.probabilities import rivalry
from testbed.diagnosis.leg.search import Search
from testbed.machine.names import LEGS

FILE = Path(__file__).with_name("calibration.yaml")
Names = tuple[str, ...]


@dataclass(frozen=True)
class RobotSigns:
    """`gain`, `fall`: what the best single effect gains over the refit in held-out log-likelihood, and how far it
    lowers some group's noise; `more`, `more_fall`: what the best larger set adds to it; `worst`: noise that the best
    set leaves in the worst leg, over that of the two best legs; `gains`: every set that was tried, with its gain.
    """

    gain: float
    fall: float
    more: float
    more_fall: float
    worst: float
    gains: tuple[tuple[Names, float], ...]

    def as_json(self) -> dict[str, Any]:
        """Plain dictionaries and lists."""
        return asdict(self)

    @classmethod
    def from_json(cls, row: Mapping[str, Any]) -> RobotSigns:
        """The signs that `as_json` wrote."""
        return cls(**{**row, "gains": tuple((tuple(n), float(g)) for n, g in row["gains"])})


def signs_of(state: Search) -> RobotSigns:
    """The signs of a finished search."""
    tried = list(state.tried.values())
    first = max((c for c in tried if len(c.names) == 1), key=state.gain, default=None)
    more = max((c for c in tried if len(c.names) > 1), key=state.gain, default=None)
    gain = state.gain(first) if first else 0.0
    return RobotSigns(
        gain=gain,
        fall=state.fall(first, state.refit) if first else 0.0,
        more=state.gain(more) - gain if more and first else 0.0,
        more_fall=state.fall(more, first) if more and first else 0.0,
        worst=_worst(state),
        gains=tuple((c.names, state.gain(c)) for c in tried if c.names),
    )


def _worst(state: Search) -> float:
    """How far one leg's residual stays above the others'; 1 where all are alike."""
    best = state.best or state.refit
    worst = 1.0
    for channel in ("force", "force_held", "flow_a", "flow_b"):
        unsure = state.problem.unsure[channel]
        scales = sorted(
            float(np.hypot(v, unsure)) for k, v in best.evidence.scale.items() if k[0] == channel
        )
        if len(scales) == len(LEGS):
            worst = max(worst, scales[-1] / (0.5 * (scales[0] + scales[1])))
    return worst


Weights = Mapping[str, Mapping[str, float]]


@cache
def calibration() -> Weights:
    """The numbers that this version ships: question -> sign -> weight."""
    import yaml

    row = yaml.safe_load(FILE.read_text(encoding="utf-8"))
    return {question: row[question] for question in ("strange", "presence", "second", "rivals")}


def questions(s: RobotSigns) -> dict[str, dict[str, float]]:
    """Question -> sign -> value."""
    return {
        "strange": {"one": 1.0, "worst": _log(s.worst, 1.0)},
        "presence": {"one": 1.0, "gain": _log(s.gain, 0.5), "fall": _log(s.fall, 1e-3)},
        "second": {
            "one": 1.0,
            "more": _log(s.more, 0.5),
            "fall": _log(s.more_fall, 1e-3),
            "first": _log(s.gain, 0.5),
        },
    }


def _log(value: float, least: float) -> float:
    return float(np.log(max(value, least)))


def distribution(s: RobotSigns, weights: Weights) -> dict[Names, float]:
    """Set of names -> probability, adding up to 1; the empty set is `none`, ("unnamed",) what no name covers."""
    totals = {
        q: sum(weights[q][k] * v for k, v in asked.items()) for q, asked in questions(s).items()
    }
    answers = {q: float(1.0 / (1.0 + np.exp(-np.clip(t, -30.0, 30.0)))) for q, t in totals.items()}
    singles, larger = (
        [(n, g) for n, g in s.gains if (len(n) > 1) == many] for many in (False, True)
    )
    missing = answers["strange"]
    some = answers["presence"] if singles else 0.0
    two = answers["second"] if larger else 0.0
    out: dict[Names, float] = {("unnamed",): missing, (): (1.0 - missing) * (1.0 - some)}
    r = weights["rivals"]
    for group, whole in ((singles, some * (1.0 - two)), (larger, some * two)):
        for names, share in rivalry(group, r["slack"], r["share"], r["power"]):
            out[names] = out.get(names, 0.0) + (1.0 - missing) * whole * share
    return out
