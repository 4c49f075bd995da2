"""Two models at once: `carries` (the load walks at random, and is no less than m0) and `lost` (the
load is zero).

Each predicts the next estimate; Bayes' rule and a small chance of changing over between them give
the odds. Loads are judged with the spread s of estimates, a walk of q N a sample. The score is the
log of the odds of `lost`, in nats.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

from testbed.compiled import njit
from testbed.estimation.detectors.base import CompiledDetector
from testbed.formats.records import Record, quantity

LARGEST = 30.0
"""Log odds are kept within this."""


class ModelNumbers(Record):
    """Of the two models."""

    least_load = quantity("N", "m0: the least load still carried")
    sd = quantity("N", "s: standard deviation of the estimate")
    walk = quantity("N", "q: standard deviation of the load's walk over a sample")
    chance = quantity("1", "of changing over from one model to the other, a sample")
    limit = quantity("1", "nats that one sample may add")


class ModelState(Record):
    """Of one foot."""

    load = quantity("N", "where the load is, if it is carried")
    variance = quantity("N2", "how well that is known")
    odds = quantity("1", "log of the odds of `lost`")
    started = quantity("1", "1 once there was a sample")


@njit
def changed_over(odds: float, chance: float) -> float:
    """Log odds after one sample in which either model may have become the other with this
    chance.
    """
    lost = 1.0 / (1.0 + math.exp(-odds))
    lost = lost * (1.0 - chance) + (1.0 - lost) * chance
    return math.log(lost / (1.0 - lost))


@njit
def step(sample: Any, foot: int, numbers: Any, state: Any, dt_s: float) -> float:
    """One sample of one foot."""
    z, noise = sample.row.estimate.own[foot], numbers.sd**2
    if state.started == 0.0:
        state.load, state.variance = max(z, numbers.least_load), noise
        state.started, state.odds = 1.0, -LARGEST
    state.variance += numbers.walk**2
    spread = state.variance + noise
    carried, lost = z - state.load, max(z, 0.0)
    gain = 0.5 * (carried * carried / spread - lost * lost / noise + math.log(spread / noise))
    gain = min(max(gain, -numbers.limit), numbers.limit)
    odds = changed_over(state.odds, numbers.chance) + gain
    state.odds = min(max(odds, -LARGEST), LARGEST)
    share = state.variance / spread
    state.load = max(state.load + share * carried, numbers.least_load)
    state.variance *= 1.0 - share
    return float(state.odds)


class MultipleModel(CompiledDetector, step=step):
    """On the own estimate. 1600 N is twice the believed break-away force, 620 + 180 N."""

    name, text = "multiple_model", "two models, Bayes"
    threshold = 5.779
    scored_in = "1"
    Numbers, State = ModelNumbers, ModelState
    numbers: ClassVar[dict[str, float]] = {
        "least_load": 1600.0,
        "sd": 250.0,
        "walk": 60.0,
        "chance": 1.0e-6,
        "limit": 4.0,
    }
