"""Every hypothesis about a recording, by its evidence: nothing, one effect at one place, two of
them, or no name.

Gram matrices over all candidates are added up once; a hypothesis then costs a factorisation of a
few numbers.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import numpy.typing as npt
from scipy.special import log_ndtr

from testbed.diagnosis.robot.groups import MOST_NUMBERS, Balances, Candidate
from testbed.diagnosis.robot.held_out_parts import PARTS, Alone, log_evidence, parts_of
from testbed.diagnosis.robot.unexplained import is_unexplained
from testbed.effects import kind_of, place_of
from testbed.machine.names import AXES

Array = npt.NDArray[np.float64]
SEEDS = 8
"""So many of the best single effects are tried with every other one."""
ALONE = 10.0
"""Ln of the evidence that a part of a recording has something of its own that is shaped as an
effect is there: so much more must speak for it (E).
"""
MATTERS = 1.0 / 3.0
"""An effect of a single number is at least this share of what it may be expected to be: a smaller
one is none that anybody would look for, and models are wrong by as much (E).
"""
SURELY_BELOW = 1.0
"""A number that cannot be negative and seems to be, by so many standard deviations, is held at 0
where its effect has others.
"""
DRAWS = 1000
"""Of an effect's likely numbers so many are tried, the same in every run."""
KEPT = 60
"""Of all hypotheses so many of the best are reported."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A set of effects at their places, with the evidence for it and what it makes of their
    numbers.
    """

    names: tuple[str, ...]
    log_factor: float
    """Ln of the Bayes factor against a sound machine."""
    mean: Array
    covariance: Array
    price: float = 0.0
    """What its evidence is less for numbers with which it would be another effect: these balances
    do not tell it from that one.
    """
    possible: float = 0.0
    """Ln of the share of its likely numbers with which it could be; part of its evidence."""
    bent: float | None = None
    """What of the weaker of two effects an error of any course at the place of the stronger one
    explains as well: for two at one place, or at cylinders of one leg, which another's forces
    reach; None where no such error is sought there.
    """


class Ledger:
    """Evidence of any set of a recording's candidates."""

    def __init__(self, balances: Balances, left_out: Iterable[str] = ()) -> None:
        self.balances = balances
        self.names = tuple(n for n in balances.candidates if n not in set(left_out))
        sizes = [len(balances.candidates[n].signature) for n in self.names]
        ends = np.cumsum([0, *sizes])
        self._where = {
            n: np.arange(first, last)
            for n, first, last in zip(self.names, ends[:-1], ends[1:], strict=True)
        }
        self._matters = np.repeat([MATTERS if size == 1 else 0.0 for size in sizes], sizes)
        self._price = {n: _price(balances.candidates[n]) for n in self.names}
        self._width = np.concatenate([balances.candidates[n].spreads for n in self.names])
        least = np.concatenate([balances.candidates[n].least for n in self.names])
        self._least = least / self._width
        self._alone = Alone(balances, {n: self._width[where] for n, where in self._where.items()})
        whole = int(ends[-1])
        self._part_gradient = np.zeros((PARTS, whole))
        self._part_information = np.zeros((PARTS, whole, whole))
        for key, group in balances.groups.items():
            shown = [n for n in self.names if n in group.columns]
            if not shown:
                continue
            index = np.concatenate([self._where[n] for n in shown])
            columns = np.hstack([group.columns[n] for n in shown]) * self._width[index]
            part = parts_of(balances.raw[key].time_s)
            for k in range(PARTS):
                rows = columns[part == k]
                self._part_gradient[k, index] += rows.T @ group.missing[part == k]
                self._part_information[k][np.ix_(index, index)] += rows.T @ rows
        self.gradient = self._part_gradient.sum(axis=0)
        self._information = self._part_information.sum(axis=0)

    def hypothesis(self, names: tuple[str, ...]) -> Hypothesis:
        """The evidence of a set, and its numbers one effect's after the other's."""
        if not names:
            return Hypothesis((), 0.0, np.zeros(0), np.zeros((0, 0)))
        index = self._index(names)
        scaled = self._information[np.ix_(index, index)] + np.eye(len(index))
        free = self._free(scaled, index)
        inside, gradient = scaled[np.ix_(free, free)], self.gradient[index[free]]
        inverse: Array = np.asarray(np.linalg.inv(inside), dtype=np.float64)
        size = np.linalg.slogdet(inside)[1]
        factor = 0.5 * float(gradient @ inverse @ gradient) - 0.5 * float(size)
        mean, covariance = np.zeros(len(index)), np.diag(1.0 / np.diag(scaled))
        mean[free], covariance[np.ix_(free, free)] = inverse @ gradient, inverse
        spread, matters, least = (
            np.sqrt(np.diag(covariance)),
            self._matters[index],
            self._least[index],
        )
        for k in np.flatnonzero(free & (np.isfinite(least) | (matters > 0.0))):
            factor += log_gained(mean[k], spread[k], matters[k], least[k])
        factor -= sum(self._price[n] for n in names)
        width = self._width[index]
        mean, whole = width * mean, covariance * np.outer(width, width)
        possible = sum(self._log_possible(n, names, mean, whole) for n in names)
        return Hypothesis(names, factor + possible, mean, whole, 0.0, possible)

    def _log_possible(self, name: str, names: tuple[str, ...], mean: Array, whole: Array) -> float:
        """Ln of the share of the likely numbers of an effect, one of a set, with which it could be,
        by that of all its expected numbers; either is no less than of a single draw.
        """
        candidate = self.balances.candidates[name]
        if not candidate.effect.overrides("possible"):
            return 0.0
        first = sum(len(self._where[n]) for n in names[: names.index(name)])
        own = slice(first, first + len(self._where[name]))
        draws = _draws(own.stop - first)
        shares = []
        for drawn in (
            mean[own] + draws @ np.linalg.cholesky(whole[own, own]).T,
            draws * candidate.spreads,
        ):
            numbers = dict(zip(candidate.signature, drawn.T, strict=False))
            share = np.mean(candidate.effect.possible(numbers, candidate.scale))
            shares.append(max(float(share), 1.0 / DRAWS))
        return math.log(shares[0] / shares[1])

    def _free(self, scaled: Array, index: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
        """(k,) which of a set's numbers are not held at 0, below which they cannot be."""
        free, positive = np.ones(len(index), dtype=bool), self._least[index] == 0.0
        while positive.any():
            inverse = np.linalg.inv(scaled[np.ix_(free, free)])
            sure = np.zeros(len(index))
            sure[free] = (inverse @ self.gradient[index[free]]) / np.sqrt(np.diag(inverse))
            worst = int(np.argmin(np.where(positive, sure, 0.0)))
            if not positive[worst] or sure[worst] >= -SURELY_BELOW or free.sum() == 1:
                break
            free[worst] = False
        return free

    def foreseen(self, names: tuple[str, ...]) -> float:
        """By how much a set predicts each part of the recording, its numbers learnt from the other
        parts alone, better than a sound machine does: ln of the ratio of likelihoods.

        With its numbers as the other parts have them; or by all that they may be, less what one
        part alone may have had of the effects' shapes by chance.
        """
        index = self._index(names)
        scaled = self._information[np.ix_(index, index)] + np.eye(len(index))
        free = self._free(scaled, index)
        index = index[free]
        whole = self._information[np.ix_(index, index)] + np.eye(len(index))
        gradient = self.gradient[index]
        total, among = 0.0, 0.0
        for k in range(PARTS):
            inside = self._part_information[k][np.ix_(index, index)]
            slope = self._part_gradient[k, index]
            mean = np.linalg.solve(whole - inside, gradient - slope)
            total += float(slope @ mean - 0.5 * mean @ inside @ mean)
            rest = log_evidence(whole - inside, gradient - slope)
            among += log_evidence(whole, gradient) - rest
        return total if among <= total else max(total, among - self._by_chance(names, free))

    def _by_chance(self, names: tuple[str, ...], free: npt.NDArray[np.bool_]) -> float:
        """What it costs the effects of a set that one part alone may have their shapes without
        them: as much as that explains beyond ALONE, and at most ALONE for each, for what moves in
        one part alone, a leg that swings once, shows to the others hardly how large it is.

        `free` (k,): which of the set's numbers are not held at 0.
        """
        out, first = 0.0, 0
        for name in names:
            own = free[first : first + len(self._where[name])]
            first += len(own)
            if own.any():
                others = tuple(other for other in names if other != name)
                chance = self._alone.log_factors(name, others, own) - ALONE
                out += min(ALONE, float(np.logaddexp.reduce([0.0, *chance])))
        return out

    def price(self, name: str) -> float:
        """What an effect's evidence is less for having been picked among alternatives."""
        return self._price[name]

    def is_course(self, name: str) -> bool:
        """Whether an effect has a course in time, one of its own in each part of a recording: a
        foot that slips, or something unexplained.
        """
        return len(self._where[name]) > MOST_NUMBERS

    def held(self, one: Hypothesis) -> Hypothesis:
        """A hypothesis whose evidence is at most what it foresees of parts that are kept back,
        beside that of its courses in time, which no other part can predict; and less what it costs
        that its numbers can hardly be, however well it foresees with them.
        """
        courses = tuple(name for name in one.names if self.is_course(name))
        if courses == one.names:
            return one
        seen = self.hypothesis(courses).log_factor
        foreseen = seen + self.foreseen(one.names) - self.foreseen(courses) + one.possible
        return replace(one, log_factor=min(one.log_factor, foreseen))

    def likeness(self, one: Hypothesis, other: Hypothesis) -> float:
        """Cosine between what two sets make of the balances, divided by their noise, with their
        likeliest numbers.
        """
        index = [self._index(h.names) for h in (one, other)]
        numbers = [
            h.mean / self._width[where] for h, where in zip((one, other), index, strict=True)
        ]
        inner = [
            [
                float(a @ self._information[np.ix_(i, j)] @ b)
                for j, b in zip(index, numbers, strict=True)
            ]
            for i, a in zip(index, numbers, strict=True)
        ]
        size = math.sqrt(inner[0][0] * inner[1][1])
        return inner[0][1] / size if size > 0.0 else 0.0

    def were(self, names: tuple[str, ...], numbers: Array) -> Ledger:
        """The ledger of a recording that misses nothing but what these effects make, one's numbers
        after the other's, as they are in their own units.
        """
        out = copy.copy(self)
        index = self._index(names)
        out.gradient = self._information[:, index] @ (numbers / self._width[index])
        return out

    def numbers_of(self, name: str) -> npt.NDArray[np.int64]:
        """Where the numbers of an effect are among those of all candidates."""
        return self._where[name]

    def _index(self, names: tuple[str, ...]) -> npt.NDArray[np.int64]:
        """Where the numbers of a set are among all."""
        where = [self._where[name] for name in names]
        return np.concatenate(where) if where else np.zeros(0, dtype=np.int64)

    def expected(self, name: str) -> float:
        """Ln of the Bayes factor that an effect of a size drawn from its prior would have in the
        mean: half the sum of lambda - ln(1 + lambda) over the eigenvalues of its information.
        """
        index = self._where[name]
        inside = np.linalg.eigvalsh(self._information[np.ix_(index, index)]).clip(0.0)
        return float(0.5 * np.sum(inside - np.log1p(inside)))

    def best(self) -> list[Hypothesis]:
        """The best hypotheses of one and then of two effects, each the best first, by their
        evidence as far as it holds for parts that are kept back.
        """
        singles = [self.hypothesis((n,)) for n in self.names]
        singles.sort(key=lambda h: -h.log_factor)
        named = [h for h in singles if not is_unexplained(h.names[0])]
        pairs, tried = [], set()
        for first in named[:SEEDS]:
            for other in self.names:
                names = tuple(sorted((first.names[0], other)))
                if other == first.names[0] or names in tried or self._too_free(names):
                    continue
                tried.add(names)
                pairs.append(self.hypothesis(names))
        pairs.sort(key=lambda h: -h.log_factor)
        alone = {one.names[0]: one.log_factor for one in singles}
        pairs = [replace(one, bent=self._bent(one, alone)) for one in pairs[:KEPT]]
        held = ([self.held(one) for one in best[:KEPT]] for best in (singles, pairs))
        return [one for best in held for one in sorted(best, key=lambda h: -h.log_factor)]

    def _bent(self, pair: Hypothesis, alone: Mapping[str, float]) -> float | None:
        """See Hypothesis.bent; `alone`: ln of the evidence of single effects by name."""
        first, other = sorted(pair.names, key=lambda name: -alone[name])
        place = place_of(first)
        errors = tuple(n for n in self.names if is_unexplained(n) and place_of(n) == place)
        if not errors or not _near(first, other):
            return None
        beside, without = (self.hypothesis((*names, *errors)) for names in (pair.names, (first,)))
        added = pair.log_factor - alone[first]
        return max(added - (beside.log_factor - without.log_factor), 0.0)

    def _too_free(self, names: tuple[str, ...]) -> bool:
        """Whether a pair could explain anything: it holds no name, or two courses in time of one
        kind.
        """
        sizes = [len(self.balances.candidates[n].signature) for n in names]
        courses = min(sizes) > MOST_NUMBERS and len({kind_of(n) for n in names}) == 1
        return courses or any(is_unexplained(n) for n in names)


def _price(candidate: Candidate) -> float:
    """What the evidence of an effect is less for having been picked among alternatives."""
    return math.log(candidate.effect.looked_for) + candidate.price


def _near(one: str, other: str) -> bool:
    """Whether two effects are at one place or at cylinders of one leg."""
    places = [place_of(name) or "" for name in (one, other)]
    legs = {place.partition("_")[0] for place in places}
    return places[0] == places[1] or (len(legs) == 1 and set(places) <= set(AXES))


@cache
def _draws(numbers: int) -> Array:
    """(DRAWS, numbers) of a standard normal distribution."""
    return np.random.default_rng(numbers).standard_normal((DRAWS, numbers))


def log_gained(mean: float, spread: float, matters: float, least: float) -> float:
    """What the evidence of a number gains or loses by where it must lie.

    The number, in its expected sizes, is known to be `mean` +- `spread`; what is named is above
    `least` and, on either side, as large as `matters`: ln of the probability of that, by what it
    was before.
    """
    return _log_within(mean, spread, matters, least) - _log_within(0.0, 1.0, matters, least)


def _log_within(mean: float, spread: float, matters: float, least: float) -> float:
    above = float(log_ndtr((mean - max(matters, least)) / spread))
    if least >= -matters:
        return above
    below = float(log_ndtr((-matters - mean) / spread))
    beyond = float(log_ndtr((least - mean) / spread))
    if beyond < below:
        above = float(np.logaddexp(above, below + math.log(-math.expm1(beyond - below))))
    return above
