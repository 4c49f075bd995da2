"""Would a repeat of the rig be named the same? A bootstrap over recordings, and over blocks of time
within them.

Nothing is refitted: every set that was tried keeps its held-out residuals, and what is drawn anew
is which blocks bear witness. A set wins a draw that predicts it best, each of its names having
earned what the search asks for.
"""

from __future__ import annotations

import numpy as np

from testbed.diagnosis.leg.evidence import FREEDOM, judged
from testbed.diagnosis.leg.problem import Array
from testbed.diagnosis.leg.search import LEAST_GAIN, Candidate, Search

DRAWS = 300
Names = frozenset[str]


def wins(state: Search, recordings_too: bool = True) -> dict[Names, float]:
    """Set of names (empty: none) -> share of the draws that it wins, adding up to 1; only sets that
    win any.

    `recordings_too`: recordings are drawn anew as well as blocks; not where each is a motion of its
    own kind, without which an effect cannot be seen at all.
    """
    sets = list(state.tried)
    scores = np.stack([_by_block(state, state.tried[names]) for names in sets])
    cost = np.array([state.price(state.tried[set_]) + LEAST_GAIN * len(set_) for set_ in sets])
    totals = _drawn(state, recordings_too) @ scores.T - cost
    best = np.bincount(np.argmax(totals, axis=1), minlength=len(sets)) / DRAWS
    return {names: float(share) for names, share in zip(sets, best, strict=True) if share > 0.0}


def _by_block(state: Search, candidate: Candidate) -> Array:
    """Held-out log-likelihood of every block at the correlation times of the best description,
    shape (blocks,).
    """
    problem, known = state.problem, candidate.evidence
    memory = (state.best or state.refit).evidence.memory
    residual = judged(problem, candidate.fit)
    out = np.zeros(_blocks(state))
    for channel, values in residual.items():
        layout = problem.layout[channel]
        for number, key in enumerate(layout.names):
            here = (layout.group == number) & (layout.count > 0)
            if key not in known.scale or key not in memory:
                continue
            standardised = values[here] / layout.relative[here] / known.scale[key]
            tail = 0.5 * (FREEDOM + 1.0) * np.log1p(standardised**2 / FREEDOM) + np.log(
                known.scale[key]
            )
            np.add.at(out, layout.block[here], -tail / memory[key])
    return out


def _blocks(state: Search) -> int:
    return 1 + max(int(series.block.max()) for series in state.problem.series)


def _drawn(state: Search, recordings_too: bool) -> Array:
    """How often each draw takes each block, shape (draws, blocks)."""
    rng = np.random.default_rng(0)
    runs = [np.unique(series.block) for series in state.problem.series]
    out = np.zeros((DRAWS, _blocks(state)))
    for draw in out:
        drawn = rng.integers(len(runs), size=len(runs)) if recordings_too else range(len(runs))
        for run in drawn:
            np.add.at(draw, rng.choice(runs[run], size=len(runs[run])), 1.0)
    return out
