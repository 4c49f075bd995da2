"""The numbers of named effects by their laws as they are, where a linear signature is far from
them.

A signature says what a small effect makes, or several of fixed shape beside each other: enough to
see an effect, not to tell its size. Once a set is named its parameters are fitted to the balances
by the laws themselves (`Effect.made`), linearised anew at each estimate (Gauss-Newton), beside the
signatures of the others in the set. Before, the likeliest sets get the evidence that their laws
have: several cushions beside each other explain a spring, or less than one cushion does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular

from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.groups import Balances, Candidate
from testbed.diagnosis.robot.hypotheses import Hypothesis, Ledger
from testbed.diagnosis.robot.several_recordings import Changes, of_first
from testbed.diagnosis.robot.unexplained import listed
from testbed.effects import place_of
from testbed.effects.signature import Change, RobotSeen
from testbed.effects.terms import Coordinate

Array = npt.NDArray[np.float64]
STEPS, HALVINGS, CLOSE = 20, 6, 1e-3
"""Most steps of a fit, most halvings of one, and the gain in ln of the likelihood that ends it."""
FITTED = 8
"""So many of the best singles and pairs are weighed by their laws: as many as pairs are sought for
(hypotheses.SEEDS).
"""
DIFFERENCE = 1e-2
"""Of a coordinate's scale, for the law's slopes."""


@dataclass(frozen=True, eq=False)
class Part:
    """An effect of a set: its numbers begin at `first` among the set's and are those of
    `coordinates`, in fitted units, or, where it has none, those of its signature.
    """

    candidate: Candidate
    first: int
    coordinates: tuple[Coordinate, ...] = ()
    unseen: Mapping[str, float] = field(default_factory=dict)
    """Those of its parameters that are no coordinates."""

    @property
    def size(self) -> int:
        """How many numbers it has."""
        return len(self.coordinates) or len(self.candidate.signature)

    def own(self, numbers: Array) -> Array:
        """Its numbers among those of the set."""
        return numbers[self.first : self.first + self.size]

    def values(self, numbers: Array) -> dict[str, float]:
        """Parameters by name of its numbers, those that bend."""
        pairs = zip(self.coordinates, self.own(numbers), strict=True)
        return {c.name: float(np.exp(x) if c.log else x) for c, x in pairs}


@dataclass(frozen=True, eq=False)
class Fitted:
    """The numbers of a set and their covariance, part after part."""

    parts: tuple[Part, ...]
    mean: Array
    covariance: Array

    def parameters(self, part: Part, numbers: Array, balances: Balances) -> dict[str, float]:
        """All parameters of a part by the numbers of the set (k,)."""
        if part.coordinates:
            return {**part.unseen, **part.values(numbers)}
        names, own = part.candidate.signature, part.own(numbers).tolist()
        linear = of_first(dict(zip(names, own, strict=True)))
        candidate = part.candidate
        return candidate.effect.from_linear(linear, balances.body.seen, candidate.place)


def fitted(balances: Balances, chosen: Hypothesis) -> Fitted:
    """The numbers of a hypothesis, by the laws of those of its effects that bend."""
    linear = _linear(balances, chosen)
    if not any(_bends(part.candidate) for part in linear.parts):
        return linear
    return _Fit(balances, linear).result()


def _linear(balances: Balances, chosen: Hypothesis) -> Fitted:
    """A hypothesis as the signatures have it."""
    candidates = [balances.candidates[name] for name in chosen.names]
    firsts = np.cumsum([0, *(len(c.signature) for c in candidates)])
    parts = tuple(Part(c, int(k)) for c, k in zip(candidates, firsts, strict=False))
    return Fitted(parts, chosen.mean, chosen.covariance)


def weighed_by_law(ledger: Ledger, tried: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The hypotheses of a search with the evidence that laws have which bend forces alone, singles
    first, the best of each first.

    FITTED of the best singles and of the best pairs are fitted; a pair beyond those is at most as
    likely as its single effects' laws leave it.
    """
    out: list[Hypothesis] = []
    lost: dict[str, float] = {}
    for size in (1, 2):
        of_size = [one for one in tried if len(one.names) == size]
        found = []
        for k, one in enumerate(of_size):
            bent = [n for n in one.names if has_whole_law(ledger.balances.candidates[n])]
            price = 0.0
            if bent and k < FITTED:
                evidence, price = _law_evidence(ledger, one)
                change = evidence - ledger.hypothesis(one.names).log_factor
            else:
                change = sum(lost.get(name, 0.0) for name in bent)
            if size == 1 and bent:
                lost[one.names[0]] = min(change, 0.0)
            found.append(replace(one, log_factor=one.log_factor + change, price=price))
        out += sorted(_as_twins(found), key=lambda h: -h.log_factor)
    return out


def _as_twins(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Hypotheses of one size with their price given back where another effect at the same place
    explains more instead: it is what they were priced for, and makes the same there. What is left
    between the two is how likely their numbers are.
    """
    out = []
    for one in found:
        twins = (h.log_factor for h in found if one.price > 0.0 and _are_twins(one, h))
        if max(twins, default=-np.inf) > one.log_factor:
            one = replace(one, log_factor=one.log_factor + one.price, price=0.0)
        out.append(one)
    return out


def _are_twins(one: Hypothesis, other: Hypothesis) -> bool:
    own, others = set(one.names) - set(other.names), set(other.names) - set(one.names)
    places = [{place_of(name) for name in names} for names in (own, others)]
    return len(own) == len(others) == 1 and places[0] == places[1] and listed(tuple(others))


def has_whole_law(candidate: Candidate) -> bool:
    """Whether an effect's law bends and is whole: what it makes is forces alone."""
    return bool(candidate.effect.bends) and candidate.effect.seen_in == ("force",)


def by_whole_laws(ledger: Ledger, one: Hypothesis) -> float:
    """Ln of the Bayes factor of a set, by its laws where some of them bend forces alone, and
    without what their numbers cost: of two that explain as much neither is priced for being the
    other.
    """
    if not any(has_whole_law(ledger.balances.candidates[name]) for name in one.names):
        return one.log_factor
    return sum(_law_evidence(ledger, one))


def _law_evidence(ledger: Ledger, hypothesis: Hypothesis) -> tuple[float, float]:
    """Ln of the Bayes factor of a set against a sound machine by its whole laws, where the fit to
    them ends (Laplace); and what of it its numbers cost. Other effects of the set are weighed by
    their signatures, as they are beside one that does not bend: a law that says nothing of the oil
    would explain more of a set for that.
    """
    fit = _Fit(ledger.balances, _linear(ledger.balances, hypothesis), has_whole_law)
    evidence, price = fit.evidence()
    return evidence - sum(ledger.price(name) for name in hypothesis.names), price


def _bends(candidate: Candidate) -> bool:
    """Whether an effect's law bends."""
    return bool(candidate.effect.bends)


class _Fit:
    """A fit that begins at the linear model's numbers; `bends`: of which effects by the law."""

    def __init__(
        self, balances: Balances, linear: Fitted, bends: Callable[[Candidate], bool] = _bends
    ) -> None:
        self.balances = balances
        parts: list[Part] = []
        starts, centres, sds, held = [], [], [], []
        for old in linear.parts:
            effect, first = old.candidate.effect, sum(p.size for p in parts)
            own = old.own(linear.mean)
            coordinates: tuple[Coordinate, ...] = ()
            values: dict[str, float] = {}
            if bends(old.candidate):
                values = linear.parameters(old, linear.mean, balances)
                seen = balances.body.seen
                coordinates = tuple(
                    _coordinate(old.candidate, seen, k, values[k]) for k in effect.bends
                )
                own = np.array([_fitted_unit(c, c.start) for c in coordinates])
                centre = np.array([c.prior[0] if c.prior else 0.0 for c in coordinates])
                sd = np.array([c.prior[1] if c.prior else np.inf for c in coordinates])
            else:
                centre, sd = np.zeros(len(own)), old.candidate.spreads
            unseen = {k: v for k, v in values.items() if k not in effect.bends}
            parts.append(Part(old.candidate, first, coordinates, unseen))
            starts.append(own)
            centres.append(centre)
            sds.append(sd)
            held.append(np.zeros(len(own), dtype=bool) if coordinates else own == 0.0)
        self.parts = tuple(parts)
        self.start, self.centre, self.sd = map(np.concatenate, (starts, centres, sds))
        self.free = ~np.concatenate(held)
        names = {part.candidate.name for part in parts}
        shown = [g for k, g in balances.raw.items() if names & set(balances.groups[k].columns)]
        self.groups = [(group, group.root()) for group in shown]

    def result(self) -> Fitted:
        """The likeliest numbers, and how far they may lie from them."""
        numbers = self._likeliest()
        return Fitted(self.parts, numbers, self._step(numbers)[1])

    def evidence(self) -> tuple[float, float]:
        """Ln of the Bayes factor against a sound machine, taken for normal about the likeliest
        numbers; and what these numbers cost in it.
        """
        numbers = self._likeliest()
        sd, free = self.sd[self.free], np.ix_(self.free, self.free)
        size = np.linalg.slogdet(self._step(numbers)[1][free] / np.outer(sd, sd))[1]
        nothing = sum(float(m @ m) for m in (_divided(g.missing, r) for g, r in self.groups))
        price = sum(self._price(part, numbers) for part in self.parts if part.coordinates)
        return 0.5 * nothing - self._cost(numbers) + 0.5 * float(size) - price, price

    def _price(self, part: Part, numbers: Array) -> float:
        """What its numbers cost an effect: of several recordings one is enough to show that it is
        no other.
        """
        effect, place, values = part.candidate.effect, part.candidate.place, part.values(numbers)
        return min(effect.robot_price(b.seen, place, values) for b in self.balances.bodies)

    def _likeliest(self) -> Array:
        """The likeliest numbers."""
        numbers, cost = self.start, self._cost(self.start)
        for _ in range(STEPS):
            step, _ = self._step(numbers)
            for halving in range(HALVINGS):
                tried = within(self.parts, numbers + step * 0.5**halving)
                found = self._cost(tried)
                if found < cost:
                    break
            else:
                break
            gain, numbers, cost = cost - found, tried, found
            if gain < CLOSE:
                break
        return numbers

    def _left(self, numbers: Array) -> list[Array]:
        """What the numbers leave of each group, divided by its noise."""
        changes = [change for part in self.parts for change in self._changes(part, numbers)]
        return [
            _divided(group.missing - sum(group.rows_of(change) for change in changes), root)
            for group, root in self.groups
        ]

    def _changes(self, part: Part, numbers: Array) -> Sequence[Change]:
        """What a part makes by its numbers."""
        if part.coordinates:
            return [self._made(part, part.values(numbers))]
        pairs = zip(part.candidate.signature.values(), part.own(numbers).tolist(), strict=True)
        return [change.times(number) for change, number in pairs if number != 0.0]

    def _made(self, part: Part, values: Mapping[str, float]) -> Change:
        """What a part's law makes of these parameters, in each of several recordings."""
        made = partial(part.candidate.effect.made, place=part.candidate.place, values=values)
        if not self.balances.others:
            return made(self.balances.body.seen)
        return Changes(parts=tuple(made(body.seen) for body in self.balances.bodies))

    def _cost(self, numbers: Array) -> float:
        """- ln of their probability."""
        rests = [*self._left(numbers), (numbers - self.centre) / self.sd]
        return 0.5 * sum(float(rest @ rest) for rest in rests)

    def _step(self, numbers: Array) -> tuple[Array, Array]:
        """The step to where the linearised balances are likeliest, and the covariance there."""
        inside, slope = np.eye(len(numbers)), (self.centre - numbers) / self.sd
        for (group, root), left in zip(self.groups, self._left(numbers), strict=True):
            columns = _divided(self._columns(group, numbers) * self.sd, root)
            inside += columns.T @ columns
            slope += columns.T @ left
        free = np.ix_(self.free, self.free)
        step, covariance = np.zeros(len(numbers)), np.diag(1.0 / np.diag(inside))
        covariance[free] = np.linalg.inv(inside[free])
        moving = self.free & ~self._pushed_out(numbers, slope)
        step[moving] = np.linalg.solve(inside[np.ix_(moving, moving)], slope[moving])
        return self.sd * step, covariance * np.outer(self.sd, self.sd)

    def _pushed_out(self, numbers: Array, slope: Array) -> npt.NDArray[np.bool_]:
        """(k,) the numbers at a bound beyond which they are likelier."""
        nudge = DIFFERENCE**2 * np.sign(slope) * np.where(np.isfinite(self.sd), self.sd, 1.0)
        nudged = numbers + nudge
        return np.asarray((within(self.parts, nudged) == numbers) & (slope != 0.0), dtype=np.bool_)

    def _columns(self, group: RawGroup, numbers: Array) -> Array:
        """(rows, k) how a group's rows change with each number."""
        out = []
        for part in self.parts:
            if not part.coordinates:
                out += [group.rows_of(change) for change in part.candidate.signature.values()]
            for k, c in enumerate(part.coordinates, part.first):
                ends = []
                for way in (1.0, -1.0):
                    moved = numbers.copy()
                    moved[k] += way * DIFFERENCE * c.scale
                    ends.append(group.rows_of(self._made(part, part.values(moved))))
                out.append((ends[0] - ends[1]) / (2.0 * DIFFERENCE * c.scale))
        return np.column_stack(out)


def _coordinate(candidate: Candidate, seen: RobotSeen, name: str, value: float) -> Coordinate:
    """A parameter as a number to be fitted, on a machine of this size and build, from a value of
    it.
    """
    effect = candidate.effect
    spec = effect.spec(name)
    lowest = spec.prior[0] if spec.log else spec.low
    found = spec.coordinate(effect.kind, max(value, lowest), effect.seen_in)
    sized = found.sized(effect.grows(name, candidate.scale), found.low, found.high)
    low, high = effect.lies_within(name, seen, candidate.place)
    low, high = max(low, sized.low), min(high, sized.high)
    return replace(sized, low=low, high=high, start=min(max(sized.start, low), high))


def within(parts: Sequence[Part], numbers: Array) -> Array:
    """Numbers of a set (k,) within the bounds of their coordinates."""
    out = numbers.copy()
    for part in parts:
        for k, c in enumerate(part.coordinates, part.first):
            out[k] = np.clip(out[k], _fitted_unit(c, c.low), _fitted_unit(c, c.high))
    return out


def _fitted_unit(c: Coordinate, value: float) -> float:
    return float(np.log(value)) if c.log else value


def _divided(rows: Array, root: Array) -> Array:
    return np.asarray(solve_triangular(root, rows, lower=True, check_finite=False))
