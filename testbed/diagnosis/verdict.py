"""From evidence to a verdict: probabilities over sets of names, refusal, and groups that the data cannot tell apart.

The numbers below were set on rigs of the independent reference leg (`testbed evaluate-diagnosis` measures how well
the probabilities that come out match the rate of being right); none of these thresholds was
set on an outside recording. Three constants of the balances were chosen on outside rigs, which are therefore no blind
test of them: the orifice's smoothing (0.5 bar), the command's lead (0.75 sample), the pre-sliding travel (0.12 mm).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from testbed.diagnosis.search import Candidate, Search
from testbed.diagnosis.unexplained import Unexplained

TEMPERATURE = 8.0
"""Log-likelihood that counts as one unit of belief between rival sets: the noise's model is not exact."""
AMBIGUOUS = 24.0
"""A rival within this gain of the chosen name is reported as not told apart."""


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
    return _logistic(2.0 * np.log(max(gain, 0.1) / 25.0) + 4.0 * np.log(max(fall, 1e-4) / 0.04))


def second(gain: float, fall: float, first_gain: float) -> float:
    """Probability of one more effect beside those already named.

    What a strong first effect's own formula leaves over looks like a small second one: that has to be exceeded.
    """
    return _logistic(
        1.5 * np.log(max(gain, 0.1) / (60.0 + 0.01 * max(first_gain, 0.0))) + 4.0 * np.log(max(fall, 1e-4) / 0.3)
    )


def outside(found: Unexplained, best: Candidate, kind: str) -> float:
    """Probability that what is there has no name: the residual stays far above the floor of the sensors."""
    if kind != "vertical-leg":
        # A bench declares no sensors: how small its residual could be is not known.
        return 0.05 if best.names else 0.2
    worst = max(found.excess_best, key=lambda k: found.excess_best[k])
    excess, start = found.excess_best[worst], max(found.excess_refit.values())
    closed = 1.0 - (excess / max(start, excess)) ** 2
    return _logistic(5.0 * np.log(max(excess, 1.0) / 3.4) - 6.0 * closed)


def decide(state: Search, found: Unexplained) -> Verdict:
    """The distribution over sets and the verdict."""
    weights = _weights(state)
    missing = outside(found, state.best or state.refit, state.problem.base.rig)
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
    fall = first.evidence.largest_fall(state.refit.evidence)
    some = presence(state.gain(first), fall)
    out: dict[tuple[str, ...], float] = {(): 1.0 - some}
    more = [c for c in state.tried.values() if len(c.names) > 1]
    two = 0.0
    if more:
        best = max(more, key=state.gain)
        two = second(
            state.gain(best) - state.gain(first), best.evidence.largest_fall(first.evidence), state.gain(first)
        )
    for group, share in ((singles, some * (1.0 - two)), (more, some * two)):
        if not group or share <= 0.0:
            continue
        gains = np.array([state.gain(c) for c in group])
        belief = np.exp(np.clip((gains - gains.max()) / TEMPERATURE, -50.0, 0.0))
        for c, b in zip(group, belief / belief.sum(), strict=True):
            out[c.names] = out.get(c.names, 0.0) + share * float(b)
    return out


def _ambiguous(state: Search, chosen: Candidate) -> dict[str, tuple[str, ...]]:
    """For each chosen name, the names that could stand in its place within AMBIGUOUS of gain."""
    out: dict[str, tuple[str, ...]] = {}
    for name in chosen.names:
        rest = frozenset(chosen.names) - {name}
        rivals = [
            (c, next(iter(frozenset(c.names) - rest)))
            for c in state.tried.values()
            if len(c.names) == len(chosen.names) and rest < frozenset(c.names) and name not in c.names
        ]
        near = [(state.gain(c), n) for c, n in rivals if state.gain(chosen) - state.gain(c) < AMBIGUOUS]
        out[name] = tuple(n for _, n in sorted(near, reverse=True))
    return out
