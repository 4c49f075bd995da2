"""From evidence to a verdict: probabilities over sets of names, refusal, and groups that the data cannot tell apart.

For legs the numbers of `presence`, `second` and `outside` are logistic regressions on 141 rigs of the independent
reference leg, seeds 400 to 463 and 500 to 658 (`testbed evaluate-diagnosis` judges on others), sharpened by SHARP,
which was chosen on the same rigs for the least calibration error; no number was fitted to an outside recording. Three
constants of the balances were chosen on outside rigs, which are therefore no blind test of them: the orifice's
smoothing (0.5 bar), the command's lead (0.75 sample), the pre-sliding travel (0.12 mm). For measured benches, which
declare less, the numbers are set by hand; there the probabilities are not calibrated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from testbed.diagnosis.search import Candidate, Search
from testbed.diagnosis.unexplained import Unexplained

TEMPERATURE = {"vertical-leg": 8.0, "cylinder": 8.0, "drive": 8.0, "robot": 2.5}
"""Log-likelihood that counts as one unit of belief between rival sets: the noise's model is not exact."""
SHARP = 1.6
"""The regressions were held back towards 0; undone by this factor."""
AMBIGUOUS = 3.0
"""A rival within so many units of belief of the chosen name is reported as not told apart."""


@dataclass(frozen=True)
class Verdict:
    """`kind`: effect, none or unnamed. `hypotheses`: (names, probability), adding up to 1, best first."""

    kind: str
    chosen: Candidate
    hypotheses: tuple[tuple[tuple[str, ...], float], ...]
    ambiguous: dict[str, tuple[str, ...]]

    def probability(self, name: str) -> float:
        """Probability that the effect is there: of all sets that hold it."""
        return float(sum(p for names, p in self.hypotheses if name in names))


def _logistic(x: float) -> float:
    return float(1.0 / (1.0 + np.exp(-np.clip(x, -30.0, 30.0))))


def presence(gain: float, fall: float, kind: str = "vertical-leg") -> float:
    """Probability that an effect is there at all: held-out gain, and how far it lowers some group's noise."""
    g, f = np.log(max(gain, 0.1)), np.log(max(fall, 1e-4))
    if kind == "robot":
        return _logistic(2.0 * (g - np.log(8.0)) + 4.0 * (f - np.log(0.15)))
    if kind != "vertical-leg":
        return _logistic(2.0 * (g - np.log(25.0)) + 4.0 * (f - np.log(0.04)))
    return _logistic(SHARP * (-6.9 + 1.91 * g + 1.18 * f))


def second(gain: float, fall: float, first_gain: float, kind: str = "vertical-leg") -> float:
    """Probability of one more effect beside those already named.

    What a strong first effect's own formula leaves over looks like a small second one: that has to be exceeded.
    """
    g, f = np.log(max(gain, 0.1)), np.log(max(fall, 1e-4))
    if kind != "vertical-leg":
        start = np.log(60.0 + 0.01 * max(first_gain, 0.0))
        return _logistic(1.5 * (g - start) + 4.0 * (f - np.log(0.3)))
    return _logistic(SHARP * (2.95 + 0.70 * g + 1.63 * f - 0.50 * np.log(max(first_gain, 10.0))))


def outside(found: Unexplained, best: Candidate, kind: str, gain: float) -> float:
    """Probability that what is there has no name: the residual stays far above the floor of the sensors and the best
    set (of held-out gain `gain`) closed little of it; or generic terms, which surely gain, gain more than it does."""
    if kind != "vertical-leg":
        # A bench declares no sensors: how small its residual could be is not known.
        return 0.05 if best.names else 0.2
    excess, start = max(found.excess_best.values()), max(found.excess_refit.values())
    closed = 1.0 - (excess / max(start, excess)) ** 2
    more = np.log(max(found.generic_gain, 1.0) / max(gain, 1.0))
    above = _logistic(1.3 * (-3.8 + 3.3 * np.log(max(excess, 1.0)) - 4.0 * closed + 0.1 * max(more, -9.0)))
    generic = presence(found.generic_gain, found.generic_fall) * _logistic(3.0 * (more - np.log(0.7)))
    return 1.0 - (1.0 - above) * (1.0 - generic)


def decide(state: Search, found: Unexplained) -> Verdict:
    """The distribution over sets and the verdict."""
    gain = max(state.gain(c) for c in state.tried.values())
    return decide_among(state, outside(found, state.best or state.refit, state.problem.kind, gain))


def decide_among(state: Search, missing: float) -> Verdict:
    """The same, given the probability `missing` that what is there has no name."""
    weights = _weights(state)
    weights = {names: w * (1.0 - missing) for names, w in weights.items()}
    weights[("unnamed",)] = missing
    total = sum(weights.values())
    ranked = sorted(((n, w / total) for n, w in weights.items()), key=lambda item: -item[1])
    top = ranked[0][0]
    if top == ("unnamed",):
        return Verdict("unnamed", state.refit, tuple(ranked), {})
    chosen = next(c for c in state.tried.values() if frozenset(c.names) == frozenset(top))
    return Verdict("effect" if top else "none", chosen, tuple(ranked), _ambiguous(state, chosen))


def _weights(state: Search) -> dict[tuple[str, ...], float]:
    """Weights of the sets that were tried: presence of a first effect, of a second, and rivalry within each size."""
    singles = [c for c in state.tried.values() if len(c.names) == 1]
    if not singles:
        return {(): 1.0}
    first = max(singles, key=state.gain)
    kind = state.problem.kind
    some = presence(state.gain(first), state.fall(first, state.refit), kind)
    out: dict[tuple[str, ...], float] = {(): 1.0 - some}
    more = [c for c in state.tried.values() if len(c.names) > 1]
    two = 0.0
    if more:
        best = max(more, key=state.gain)
        fall = state.fall(best, first)
        two = second(state.gain(best) - state.gain(first), fall, state.gain(first), kind)
    for group, share in ((singles, some * (1.0 - two)), (more, some * two)):
        if not group or share <= 0.0:
            continue
        gains = np.array([state.gain(c) for c in group])
        belief = np.exp(np.clip((gains - gains.max()) / TEMPERATURE[kind], -50.0, 0.0))
        for c, b in zip(group, belief / belief.sum(), strict=True):
            out[c.names] = out.get(c.names, 0.0) + share * float(b)
    return out


def _ambiguous(state: Search, chosen: Candidate) -> dict[str, tuple[str, ...]]:
    """For each chosen name, the names that could stand in its place within AMBIGUOUS units."""
    out: dict[str, tuple[str, ...]] = {}
    limit = AMBIGUOUS * TEMPERATURE[state.problem.kind]
    for name in chosen.names:
        rest = frozenset(chosen.names) - {name}
        rivals = [
            (c, next(iter(frozenset(c.names) - rest)))
            for c in state.tried.values()
            if len(c.names) == len(chosen.names) and rest < frozenset(c.names) and name not in c.names
        ]
        near = [(state.gain(c), n) for c, n in rivals if state.gain(chosen) - state.gain(c) < limit]
        out[name] = tuple(n for _, n in sorted(near, reverse=True))
    return out
