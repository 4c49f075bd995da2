"""From evidence to a distribution over sets of names.

Each hypothesis has ln of a Bayes factor against a sound machine (hypotheses.py), as far as it holds
for parts of the recording that are kept back. It is exact for the linear model and its noise;
neither is exact for the machine. So evidence counts by a share of itself, and a price stands
against every step away from a sound machine:

    score(none) = 0
    score(some effect) = most of share t(lead) + second - price, over all sets
    score(any course) = share' t(lead) - price(unnamed)
    second = share t(gain - bent) - price(two)               for sets of two effects
    second = share" t(gain - form_here lead) - price(two)    for two at one place where no error of
                                                             any course is sought; else 0

`lead` is ln B of a set's stronger effect alone beyond what sound machines reach, `gain` what the
other adds to it, beyond the same for its kind. Where some other effect alone explains more than the
stronger one of two, `lead` is that, and `gain` what the two explain beyond it: one effect that
explains as much as two do is no less likely for being one. t(x) = much ln(1 + x / much): no law is
known to the letter, so ten times the evidence is not ten times as sure. At a first effect's place
and at its leg its law's own error looks like a second one: what an error of any course at the first
one's place explains as well (`bent`) does not count; where none is sought evidence counts by less
(share"), beyond a share `form_here` of what the first one explains. At other places what a right
first effect leaves does not grow with what it explains.
Probabilities go as exp(score). The sets of effects divide theirs as exp(share_named lead + second):
beside each other signatures are wrong by more than a sound machine is. A kind of effect is as
likely as another, so one that has many places is less likely at each. So it is for a tolerance of
any workshop far beyond its size, too, though it gets no name.
What sound machines reach (`sound`) is known for each kind of motion (motion_kinds.py) and each kind
of effect and joint (`sort_of`): some signatures look like what the model itself is wrong about,
others like nothing, and a walk has other faults than a stand. What errors of any course at
its places explain beyond a set and LAW of it counts against it (`rest`). Errors of any course in
time fit what is wrong with the model itself, too: their evidence counts by less (share'). Sets that
hold what no name covers, a tolerance of any workshop far beyond its size, or the gains of both
sensors of one cylinder count as `unnamed`, and so does the share `lapse` of every name: so often a
name that was said of runs with known answers was wrong or not alone, however much it explained. The
numbers are in `calibration.yaml`; `testbed lab fit-robot-diagnosis` fits them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.hypotheses import Hypothesis
from testbed.diagnosis.robot.unexplained import UNNAMED, is_unexplained
from testbed.effects import by_name, kind_of, place_of
from testbed.effects.sensor_gain import BOTH
from testbed.machine.names import AXES

FILE = Path(__file__).with_name("calibration.yaml")
Array = npt.NDArray[np.float64]
Names = tuple[str, ...]
NO_NAME: Names = (UNNAMED,)
LAW = 0.1
"""Errors of any course may explain so much more than a true effect does, share of its evidence: no
law holds to the letter (E).
"""


@dataclass(frozen=True)
class RobotSigns:
    """What was tried on one recording: (names, ln of the Bayes factor against a sound machine);
    `bent`: see Hypothesis, of pairs that have it.
    """

    sets: tuple[tuple[Names, float], ...]
    bent: Mapping[Names, float] = field(default_factory=dict)
    motions: tuple[str, ...] = ()
    """What the machine did in it, see motion_kinds.py."""

    @classmethod
    def of(cls, hypotheses: list[Hypothesis], motions: tuple[str, ...]) -> RobotSigns:
        """The signs of a finished search in a recording of these kinds of motion."""
        return cls(
            tuple((h.names, round(h.log_factor, 3)) for h in hypotheses),
            {h.names: round(h.bent, 3) for h in hypotheses if h.bent is not None},
            motions,
        )

    def as_json(self) -> dict[str, Any]:
        """Plain lists by field."""
        sets = [[list(names), factor, self.bent.get(names)] for names, factor in self.sets]
        return {"motions": list(self.motions), "sets": sets}

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> RobotSigns:
        """The signs that `as_json` wrote."""
        rows = fields["sets"]
        return cls(
            tuple((tuple(names), float(factor)) for names, factor, *_ in rows),
            {tuple(names): float(bent) for names, _, bent in rows if bent is not None},
            tuple(fields["motions"]),
        )

    def sound_reach(self, sound: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
        """Sort of effect (`sort_of`) -> evidence that sound machines reach in such a recording: of
        several kinds of motion the most; `sound`: the same by kind of motion.
        """
        out: dict[str, float] = {}
        for motion in self.motions:
            for sort, reach in sound.get(motion, {}).items():
                out[sort] = max(out.get(sort, 0.0), reach)
        return out


@dataclass(frozen=True, eq=False)
class Weighed:
    """The sets of names of one recording, and what their scores are made of, (k,) each."""

    names: tuple[Names, ...]
    """NO_NAME for all that have none."""
    lead: Array
    """Evidence for the stronger effect alone, beyond what sound machines reach; of two the evidence
    for any that explains more alone.
    """
    gain: Array
    """What the other of two adds to it, likewise, as far as no error of any course at the place of
    the stronger one explains it; 0 for one effect.
    """
    here: Array
    """Evidence for the stronger of two at one place where no error of any course is sought, of
    whose law's error the other may be made.
    """
    left: Array
    """What errors of any course at its places explain beyond a set."""
    two: Array
    """1 for two effects, else 0; `unnamed` for sets without a name, `bends` for errors of any
    course likewise.
    """
    unnamed: Array
    bends: Array
    places: Array
    """Ln of how many places the effects of a set could sit at: a kind of effect is as likely as
    another, and sits at one of its places.
    """

    @classmethod
    def of(cls, signs: RobotSigns, numbers: Mapping[str, Any]) -> Weighed:
        """Beyond what the number `sound` has for its motions and each sort."""
        reach = signs.sound_reach(numbers["sound"])
        alone = {names[0]: factor for names, factor in signs.sets if len(names) == 1}
        most = max((f for name, f in alone.items() if not is_unexplained(name)), default=0.0)
        rows = [
            _weighed((names, factor), (alone, most), reach, signs) for names, factor in signs.sets
        ]
        told = tuple(NO_NAME if not has_names(names) else names for names, _ in signs.sets)
        return cls(told, *np.array(rows, dtype=np.float64).reshape(-1, 8).T)

    def scores(self, numbers: Mapping[str, Any]) -> Array:
        """(k,) against a sound machine's 0."""
        share = np.where(self.bends, numbers["share_unnamed"], numbers["share"])
        price = np.where(self.bends, numbers["unnamed"], numbers["one"])
        rest = (1.0 - self.unnamed) * numbers["rest"] * self.left
        added = tempered(self.gain - numbers["form_here"] * self.here, numbers["much"])
        second = np.where(self.here > 0.0, numbers["share_second"], numbers["share"])
        beside = self.two * (second * added - numbers["two"]) - rest
        out = np.asarray(share * tempered(self.lead, numbers["much"]) + beside - price)
        known = self.bends == 0.0
        if known.any():
            rivals = (numbers["share_named"] * self.lead + beside - self.places)[known]
            out[known] = out[known].max() + rivals - np.logaddexp.reduce(rivals)
        return out


def tempered(evidence: Array, much: float) -> Array:
    """(k,) evidence as it counts: itself where it is small against `much`, then ever less."""
    return np.where(evidence > 0.0, much * np.log1p(np.maximum(evidence, 0.0) / much), evidence)


def chances(scores: Array) -> tuple[Array, float]:
    """Probability of each set of scores (k,), and of a sound machine; together they are 1."""
    top = max(0.0, float(scores.max(initial=0.0)))
    sets, nothing = np.exp(scores - top), math.exp(-top)
    total = float(sets.sum()) + nothing
    return np.asarray(sets / total), nothing / total


def _weighed(
    one: tuple[Names, float],
    singles: tuple[Mapping[str, float], float],
    sound: Mapping[str, float],
    signs: RobotSigns,
) -> tuple[float, ...]:
    """A row of Weighed; `one`: a set with its evidence; `singles`: evidence of single effects by
    name, and the most that one of them has that is no error of any course.
    """
    (names, factor), (alone, most) = one, singles
    reach = {name: sound.get(sort_of(name), 0.0) for name in names}
    two = len(names) == 2
    first = max(names, key=lambda name: alone.get(name, 0.0)) if two else names[0]
    strong = max(alone.get(first, 0.0), 0.0) if two else factor
    leads = max(strong, most) if two else strong
    one_place = len({place_of(name) for name in names}) == 1 and names not in signs.bent
    bent = signs.bent.get(names, 0.0) + sum(reach[name] for name in names if name != first)
    return (
        leads - reach[first],
        factor - leads - bent if two else 0.0,
        strong if two and one_place else 0.0,
        _left_at_its_places(names, factor, alone),
        two,
        not has_names(names),
        any(is_unexplained(name) for name in names),
        sum(_ln_places(kind_of(name)) for name in names if not is_unexplained(name)),
    )


@cache
def sort_of(name: str) -> str:
    """What sound machines reach is alike for: a kind of effect, at cylinders for each joint of a
    leg apart.
    """
    place = place_of(name)
    return f"{kind_of(name)}@{place.partition('_')[2]}" if place in AXES else kind_of(name)


@cache
def _ln_places(kind: str) -> float:
    """Ln of how many places an effect could sit at."""
    return math.log(len(by_name(kind).places_on_robot))


def distribution(signs: RobotSigns, numbers: Mapping[str, Any]) -> dict[Names, float]:
    """Probability of every set of names, () for a sound machine and NO_NAME; they add up to 1."""
    weighed = Weighed.of(signs, numbers)
    sets, nothing = chances(weighed.scores(numbers))
    named = weighed.unnamed == 0.0
    lapsed = float(numbers["lapse"] * sets[named].sum())
    sets = np.where(named, (1.0 - numbers["lapse"]) * sets, sets)
    out: dict[Names, float] = {(): nothing}
    for names, chance in zip(weighed.names, sets.tolist(), strict=True):
        out[names] = out.get(names, 0.0) + chance
    out[NO_NAME] = out.get(NO_NAME, 0.0) + lapsed
    return out


def likeliest_nameless(signs: RobotSigns, numbers: Mapping[str, Any]) -> Names:
    """Of the sets that no name covers the one with the highest score; () where none was tried."""
    scores = Weighed.of(signs, numbers).scores(numbers).tolist()
    nameless = [
        (score, names)
        for score, (names, _) in zip(scores, signs.sets, strict=True)
        if not has_names(names)
    ]
    return max(nameless, default=(0.0, ()))[1]


def leading(weights: Mapping[Names, float], lapse: float = 0.0) -> Names:
    """What is said of a distribution: of no name and sets of names together the likelier one,
    unless a sound machine is likelier still; of sets the likeliest one, for several that are alike
    are still no sound machine. That one must be likely against a sound machine by WORTH_A_LOOK.

    The share `lapse` that names lost to NO_NAME is that of names that were wrong or not alone. It
    says how sure a name is, and does not make it likelier that none covers what is there.
    """
    named = {names: weight for names, weight in weights.items() if names not in ((), NO_NAME)}
    together, nothing = sum(named.values()), weights.get((), 0.0)
    nameless = weights.get(NO_NAME, 0.0) - together * lapse / (1.0 - lapse)
    likeliest = max(named, key=named.__getitem__, default=())
    if together > nameless and named.get(likeliest, 0.0) > WORTH_A_LOOK * nothing:
        return likeliest
    return NO_NAME if nameless > nothing else ()


WORTH_A_LOOK = 0.5
"""A set of effects is named from this probability on, as a share of a sound machine's: to miss one
costs a machine more than to look after one in vain (E). On 275 runs any share from 0.25 to 0.6
named as many of 116 visible effects rightly; 0.4 to 0.6 left 104 of 109 sound machines alone
without an earlier recording, 0.25 left 102.
"""


def _left_at_its_places(names: Names, factor: float, alone: Mapping[str, float]) -> float:
    """By how much errors of any course at the places of a set explain more than the set does, and
    LAW of it.
    """
    places = {place_of(name) for name in names}
    most = max(
        (f for n, f in alone.items() if is_unexplained(n) and place_of(n) in places), default=0.0
    )
    return max(most - (1.0 + LAW) * max(factor, 0.0), 0.0)


def has_names(names: Names) -> bool:
    """Whether every effect of a set is one that a model may lack: not unexplained, no tolerance of
    any workshop, and not the gains of both sensors of one cylinder: that both are off is rarer than
    one sensor that bends, which the list lacks and which looks like the two.
    """
    places = {place_of(name) for name in names}
    bent = {kind_of(name) for name in names} == BOTH and len(places) == 1
    nameless = (is_unexplained(n) or by_name(kind_of(n)).is_tolerance for n in names)
    return not (bent or any(nameless))


@cache
def calibration() -> Mapping[str, Any]:
    """The numbers that are shipped."""
    import yaml

    found: Mapping[str, Any] = yaml.safe_load(FILE.read_text(encoding="utf-8"))
    return found
