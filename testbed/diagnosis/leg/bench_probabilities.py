"""From signs to a distribution over sets of names, for benches and drives, which declare little of themselves.

Three questions, each a logistic regression on a few signs of the names that are left after their trials (`proof`):

    P(no name covers what is there) = L(unnamed),   P(an effect | a name would cover it) = L(presence)
    P(this set | an effect) = (1 - stray) * share of the bootstrap's draws that it wins + stray * equal shares

The numbers are in `bench_calibration.yaml`, with the simulated rigs they were fitted on and how well they do on kinds of
law that were left out; `testbed lab fit-bench-diagnosis` fits them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from testbed.diagnosis.leg.entries import memory_of
from testbed.diagnosis.leg.proof import Proof
from testbed.diagnosis.leg.runs import overall
from testbed.diagnosis.leg.search import Search
from testbed.diagnosis.leg.unexplained import Unexplained

FILE = Path(__file__).with_name("bench_calibration.yaml")
Names = tuple[str, ...]


@dataclass(frozen=True)
class BenchSigns:
    """What a verdict on a bench rests on.

    `excess`: force residual over the sensors' floor, mean of the recordings' logarithms; `memory`: its correlation
    time, bins; `closed`: logarithm of the error of runs left out, by `identify` over with the names that are left;
    `generic_gain`, `generic_fall`: what generic terms add to them; `gain`: theirs over the refit; `repeated`: least
    share of draws of one of them; `companion`: share by which a channel that rides along lowers what they leave;
    `shares`: set of names, less those refused, -> share of draws.
    """

    excess: float
    memory: float
    closed: float
    generic_gain: float
    generic_fall: float
    gain: float
    repeated: float
    companion: float
    shares: tuple[tuple[Names, float], ...]

    def as_json(self) -> dict[str, Any]:
        """Plain dictionaries and lists."""
        return asdict(self)

    @classmethod
    def from_json(cls, row: Mapping[str, Any]) -> BenchSigns:
        """The signs that `as_json` wrote."""
        return cls(**{**row, "shares": tuple((tuple(n), float(p)) for n, p in row["shares"])})

    def of_unnamed(self) -> dict[str, float]:
        """What tells that no name covers what is there."""
        return {
            "one": 1.0,
            "excess": self.excess,
            "memory": float(np.log(self.memory)),
            "closed": self.closed,
            "generic": float(np.log(max(self.generic_gain, 1.0))),
            "fall": self.generic_fall,
            "companion": self.companion,
        }

    def of_presence(self) -> dict[str, float]:
        """What tells that there is an effect at all."""
        return {
            "one": 1.0,
            "gain": float(np.log(max(self.gain, 1.0))),
            "closed": self.closed,
            "repeated": self.repeated,
        }


@dataclass(frozen=True)
class BenchCalibration:
    """Question -> sign -> weight; `stray`: share of wrong names among those that are proven."""

    unnamed: Mapping[str, float]
    presence: Mapping[str, float]
    stray: float


@cache
def calibration() -> BenchCalibration:
    """The numbers that this version ships."""
    import yaml

    row = yaml.safe_load(FILE.read_text())
    return BenchCalibration(row["unnamed"], row["presence"], float(row["stray"]))


def signs(state: Search, proof: Proof, found: Unexplained, companion: float) -> BenchSigns:
    """The signs of a finished search whose names have been tried."""
    excess = [np.log(max(v, 1.0)) for v in found.excess_best.values()]
    shares: dict[Names, float] = {}
    for names, share in proof.won.items():
        left = tuple(sorted(names - set(proof.refused)))
        shares[left] = shares.get(left, 0.0) + share
    return BenchSigns(
        excess=float(np.mean(excess)) if excess else 0.0,
        memory=memory_of(proof.kept.evidence),
        closed=float(
            np.log(overall(proof.run_errors["identify"]) / overall(proof.run_errors["after"]))
        ),
        generic_gain=found.generic_gain,
        generic_fall=found.generic_fall,
        gain=state.gain(proof.kept),
        repeated=min(proof.repeated.values(), default=0.0),
        companion=companion,
        shares=tuple(shares.items()),
    )


def answer(signs_of_question: Mapping[str, float], weights: Mapping[str, float]) -> float:
    """A logistic regression's probability of a yes."""
    total = sum(weights[name] * value for name, value in signs_of_question.items())
    return float(1.0 / (1.0 + np.exp(-np.clip(total, -30.0, 30.0))))


def distribution(s: BenchSigns, kept: Names, c: BenchCalibration) -> dict[Names, float]:
    """Set of names -> probability, adding up to 1; the empty set is `none`, ("unnamed",) what no name covers.

    Sets that are not wholly made of `kept` names were not proven: their share counts for what no name covers.
    """
    missing = answer(s.of_unnamed(), c.unnamed)
    some = answer(s.of_presence(), c.presence) if kept else 0.0
    out: dict[Names, float] = {("unnamed",): missing, (): (1.0 - missing) * (1.0 - some)}
    sets = [(names, share) for names, share in s.shares if names and set(names) <= set(kept)]
    total = sum(share for _, share in sets)
    if not total:
        sets, total = [(tuple(sorted(kept)), 1.0)] if kept else [], 1.0
    for names, share in sets:
        out[names] = (1.0 - missing) * some * (1.0 - c.stray) * share / total
    out["unnamed",] += (1.0 - missing) * some * c.stray
    return out
