"""From signs to a distribution over sets of names, for benches and drives, which declare little of
themselves.

Two questions, each a logistic regression: on a few signs of the names that are left after their
trials (`proof`), and on how far dry friction vanishes with speed (`fading`):

    P(no name covers what is there) = lapse + (1 - 2 lapse) (1 - (1 - L(unnamed)) (1 - L(fading)))
    P(this set | a name would cover it) = (1 - stray) * share of the bootstrap's draws that it wins,
    P(none) = stray; P(none | a name would cover it) = 1 where no name passed its trials

What is given to the names that passed is shared with those that the data cannot tell from them
(`rivals`), by what they are behind.

The numbers are in `bench_calibration.yaml`, with the simulated rigs they were fitted on and how
well they do on kinds of law that were left out; `testbed lab fit-bench-diagnosis` fits them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from testbed.diagnosis.leg.acceptance import Proof
from testbed.diagnosis.leg.entries import memory_of
from testbed.diagnosis.leg.evidence import Evidence, Key
from testbed.diagnosis.leg.fading_friction import fading, fading_signs
from testbed.diagnosis.leg.leave_one_out import overall
from testbed.diagnosis.leg.probabilities import answer
from testbed.diagnosis.leg.rivals import exchanged
from testbed.diagnosis.leg.run_variation import steady
from testbed.diagnosis.leg.search import Search
from testbed.diagnosis.leg.unexplained import Unexplained, excess_over

FILE = Path(__file__).with_name("bench_calibration.yaml")
Names = tuple[str, ...]
SMALL = 0.4
"""Share of `none` that goes to a name against which nothing but its size speaks (E): less than
half, as no more is left without it than a sound bench leaves."""

FORETOLD = 0.7
"""Share of `none` that goes to *unnamed* where a correction without a cause takes half and more of
what is left of each run left out (E): no sound bench of 35 showed that."""


@dataclass(frozen=True)
class BenchSigns:
    """What a verdict on a bench rests on.

    `excess`: force residual, by its scale or its root mean square, over what a sound bench leaves,
    mean of the recordings' logarithms;
    `memory`: its correlation time, bins; `closed`: logarithm of the error of runs left out, by
    `identify` over with the names that are left, 0 where none is;
    `generic_gain`, `generic_fall`: what generic terms add to them, where friction may differ from
    run to run with and without these terms; `gain`: that of the names over the refit;
    `repeated`: least share of draws of one of them; `companion`: share by which a channel that
    rides along lowers what they leave;
    `shares`: set of names -> share of draws; `exchanged`: set in which a name is exchanged for one
    that it is not distinguished from -> belief in it for one in the names that are left.
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
    exchanged: tuple[tuple[Names, float], ...] = ()
    fading: float = 0.0

    def as_json(self) -> dict[str, Any]:
        """Plain dictionaries and lists."""
        return asdict(self)

    @classmethod
    def from_json(cls, row: Mapping[str, Any]) -> BenchSigns:
        """The signs that `as_json` wrote."""
        sets = {
            key: tuple((tuple(names), float(share)) for names, share in row.get(key, ()))
            for key in ("shares", "exchanged")
        }
        return cls(**{**row, **sets})

    def of_unnamed(self) -> dict[str, float]:
        """Features of *unnamed*: that no name covers what is there. A memory counts only of what
        the sensors do not leave anyway. Generic terms that only follow the noise of few data
        lower nothing, however much worse they predict the rest.
        """
        return {
            "one": 1.0,
            "excess": self.excess,
            "memory": float(np.log(self.memory)) * min(self.excess, 1.0),
            "closed": self.closed,
            "generic": float(np.log(max(self.generic_gain, 1.0))),
            "fall": max(self.generic_fall, 0.0),
            "companion": self.companion,
        }


@dataclass(frozen=True)
class BenchCalibration:
    """`unnamed`, `fading`: sign -> weight; `stray`: share of wrong names among those that passed
    their trials; `lapse`: how often a sure answer to whether a name covers it is wrong.
    """

    unnamed: Mapping[str, float]
    stray: float
    lapse: float = 0.0
    fading: Mapping[str, float] = field(default_factory=lambda: {"one": -30.0})


@cache
def calibration() -> BenchCalibration:
    """The numbers that this version ships."""
    import yaml

    row = yaml.safe_load(FILE.read_text())
    return BenchCalibration(row["unnamed"], float(row["stray"]), float(row["lapse"]), row["fading"])


def signs(state: Search, proof: Proof, found: Unexplained, companion: float) -> BenchSigns:
    """The signs of a finished search whose names have been tried."""
    shares = {tuple(sorted(names)): share for names, share in proof.won.items()}
    left = steady(state.problem, proof.kept.evidence, proof.kept.fit)
    generic = steady(state.problem, found.generic.evidence, found.generic.fit)
    errors = proof.run_errors
    usual = found.usual
    floors = {
        key: float(np.hypot(floor, usual.get(key, 0.0))) for key, floor in found.floors.items()
    }
    closed = overall(errors["identify"]) / overall(errors["after"]) if proof.kept.names else 1.0
    return BenchSigns(
        excess=float(np.log(excess_over(left, floors))),
        memory=memory_of(left),
        closed=float(np.log(closed)),
        generic_gain=generic.gain_over(left, generic),
        generic_fall=_beside(generic, usual).largest_fall(_beside(left, usual)),
        gain=state.gain(proof.kept),
        repeated=min(proof.repeated.values(), default=0.0),
        companion=companion,
        shares=tuple(shares.items()),
        exchanged=tuple(
            (tuple(sorted(names)), belief) for names, belief in exchanged(state, proof.kept).items()
        ),
        fading=fading(state.problem, proof.kept.fit, left),
    )


def _beside(found: Evidence, usual: Mapping[Key, float]) -> Evidence:
    """The evidence with what a sound bench leaves anyway in every group's scale: to take a share of
    that away is no sign.
    """
    scale = {key: float(np.hypot(value, usual.get(key, 0.0))) for key, value in found.scale.items()}
    return replace(found, scale=scale)


def distribution(
    signs: BenchSigns, kept: Names, calibration: BenchCalibration
) -> dict[Names, float]:
    """Set of names -> probability, adding up to 1; the empty set is `none`, ("unnamed",) what no
    name covers.

    Of a set that wins draws only the names count that are `kept`, or what they are not
    distinguished from.
    """
    covered = 1.0 - answer(signs.of_unnamed(), calibration.unnamed)
    covered *= 1.0 - answer(fading_signs(signs.fading), calibration.fading)
    missing = calibration.lapse + (1.0 - 2.0 * calibration.lapse) * (1.0 - covered)
    sets: dict[Names, float] = {}
    for names, share in signs.shares:
        stands_in = any(set(other) <= set(names) for other, _ in signs.exchanged)
        left = kept if stands_in else tuple(name for name in kept if name in names)
        if left:
            sets[left] = sets.get(left, 0.0) + share
    total = sum(sets.values())
    out: dict[Names, float] = {
        ("unnamed",): missing,
        (): (1.0 - missing) * (calibration.stray if sets else 1.0),
    }
    for names, share in sets.items():
        out[names] = (1.0 - missing) * (1.0 - calibration.stray) * share / total
    if kept in out and kept:
        whole = out[kept] / (1.0 + sum(belief for _, belief in signs.exchanged))
        out |= {kept: whole} | {names: whole * belief for names, belief in signs.exchanged}
    return out


def with_small(weights: Mapping[Names, float], too_small: Names) -> dict[Names, float]:
    """The weights with a share of what `none` has given to the first name that passed every trial
    but that of its size: a sound bench may leave as much, and the name explains it all the same.
    """
    out = dict(weights)
    if too_small and () in out:
        name = too_small[:1]
        given = SMALL * out[()]
        out[()] -= given
        out[name] = out.get(name, 0.0) + given
    return out


def with_foretold(weights: Mapping[Names, float]) -> dict[Names, float]:
    """The weights where what is left of each run is foretold by the other runs, and by no name."""
    given = FORETOLD * weights[()]
    return dict(weights) | {
        (): weights[()] - given,
        ("unnamed",): weights.get(("unnamed",), 0.0) + given,
    }
