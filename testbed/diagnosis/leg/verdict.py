"""From evidence to a verdict: probabilities over sets of names, refusal, and groups that the data cannot tell apart.

For legs with declared sensors and valve the probabilities come from `probabilities`, whose numbers are fitted on rigs of the
independent reference leg (`testbed evaluate-diagnosis` judges on others); no number was fitted to an outside recording.
Three constants of the balances were chosen on outside rigs, which are therefore no blind test of them: the orifice's
smoothing (0.5 bar), the command's lead (0.75 sample), the pre-sliding travel (0.12 mm). For measured benches, which
declare less, the numbers below are set by hand: probabilities there are not calibrated. A leg of the robot has its own
(`diagnosis.robot.probabilities`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from testbed.diagnosis.leg.probabilities import calibration, distribution
from testbed.diagnosis.leg.search import Candidate, Search
from testbed.diagnosis.leg.signs import signs
from testbed.diagnosis.leg.unexplained import Unexplained

TEMPERATURE = {"vertical-leg": 8.0, "cylinder": 8.0, "drive": 8.0, "robot": 2.5}
"""Log-likelihood that counts as one unit of belief between rival sets: the noise's model is not exact."""
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


def presence(gain: float, fall: float) -> float:
    """Probability that an effect is there at all: held-out gain, and how far it lowers some group's noise."""
    g, f = np.log(max(gain, 0.1)), np.log(max(fall, 1e-4))
    least, falls = 25.0, 0.04
    return _logistic(2.0 * (g - np.log(least)) + 4.0 * (f - np.log(falls)))


def second(gain: float, fall: float, first_gain: float) -> float:
    """Probability of one more effect beside those already named.

    What a strong first effect's own formula leaves over looks like a small second one: that has to be exceeded.
    """
    g, f = np.log(max(gain, 0.1)), np.log(max(fall, 1e-4))
    start = np.log(60.0 + 0.01 * max(first_gain, 0.0))
    return _logistic(1.5 * (g - start) + 4.0 * (f - np.log(0.3)))


NAMED, NOTHING = 0.05, 0.2
"""Probability that a bench's finding, or its silence, hides something without a name: it declares no sensors, so how
small its residual could be is not known."""


def decide(state: Search, found: Unexplained) -> Verdict:
    """The distribution over sets and the verdict."""
    if state.problem.kind == "vertical-leg":
        return verdict_of(state, distribution(signs(state, found), calibration()))
    missing = NAMED if state.best and state.best.names else NOTHING
    weights = {names: w * (1.0 - missing) for names, w in _weights(state).items()}
    return verdict_of(state, {**weights, ("unnamed",): missing})


def verdict_of(state: Search, weights: Mapping[tuple[str, ...], float]) -> Verdict:
    """The verdict that weights of sets of names make; ("unnamed",) is what no name covers."""
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
    some = presence(state.gain(first), state.fall(first, state.refit))
    out: dict[tuple[str, ...], float] = {(): 1.0 - some}
    more = [c for c in state.tried.values() if len(c.names) > 1]
    two = 0.0
    if more:
        best = max(more, key=state.gain)
        fall = state.fall(best, first)
        two = second(state.gain(best) - state.gain(first), fall, state.gain(first))
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
            if len(c.names) == len(chosen.names)
            and rest < frozenset(c.names)
            and name not in c.names
        ]
        near = [(state.gain(c), n) for c, n in rivals if state.gain(chosen) - state.gain(c) < limit]
        out[name] = tuple(n for _, n in sorted(near, reverse=True))
    return out
