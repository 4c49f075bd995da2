"""Generalised likelihood ratio with the colour of the noise: whitened, then tested over several
window lengths.

The estimate's error is coloured (hammering, the oil's own ring): L - m = c1 (..)_-1 + c2 (..)_-2 +
e, e white. For the whitened y = L - c1 L_-1 - c2 L_-2 a mean m gives c m, c = 1 - c1 - c2. Over the
last n samples, with the mean M that fits best,

    T_n = n / (2 s^2) [(c M - c max(M, m0))^2 - (c M - c min(M, m1))^2],   score = max over n

m0 the least load still carried, m1 the most that counts as lost, N. In nats, of either sign.
"""

from __future__ import annotations

from typing import Any, ClassVar

from testbed.compiled import njit
from testbed.estimation.detectors.base import CompiledDetector
from testbed.formats.records import Record, quantity

LENGTHS = (2, 5, 10, 20, 40)
"""Windows, samples."""
LONGEST = 40
LOWEST = -1.0e4
"""Score before the shortest window is full, nats."""


class GlrNumbers(Record):
    """What is expected of the own estimate and its noise."""

    least_load = quantity("N", "m0: the least load still carried")
    most_lost = quantity("N", "m1: the most that counts as lost")
    colour_1 = quantity("1", "c1: what the noise keeps of the last sample's")
    colour_2 = quantity("1", "c2: and of the one before")
    sd = quantity("N", "s: standard deviation of the white part")


class GlrState(Record):
    """Of one foot."""

    last = quantity("N", "load one sample ago")
    before = quantity("N", "load two samples ago")
    count = quantity("1", "samples so far")
    ring = quantity("N", "the last whitened samples, in a ring", per=LONGEST)
    sums = quantity("N", "their sums over each window", per=len(LENGTHS))


@njit
def step(sample: Any, foot: int, numbers: Any, state: Any, dt_s: float) -> float:
    """One sample of one foot."""
    load, m0, m1 = sample.row.estimate.own[foot], numbers.least_load, numbers.most_lost
    gain = 1.0 - numbers.colour_1 - numbers.colour_2
    if state.count == 0.0:
        state.last = state.before = load
    y = (load - numbers.colour_1 * state.last - numbers.colour_2 * state.before) / gain
    state.before, state.last = state.last, load
    count, best = int(state.count), LOWEST
    for k in range(len(LENGTHS)):
        n = LENGTHS[k]
        state.sums[k] += y
        if count >= n:
            state.sums[k] -= state.ring[(count - n) % LONGEST]
        if count + 1 >= n:
            mean = state.sums[k] / n
            far, near = mean - max(mean, m0), mean - min(mean, m1)
            best = max(best, 0.5 * n * (gain / numbers.sd) ** 2 * (far * far - near * near))
    state.ring[count % LONGEST] = y
    state.count += 1.0
    return best


class Glr(CompiledDetector, step=step):
    """On the own estimate. 1600 N is twice the believed break-away force, 620 + 180 N."""

    name, text = "glr", "whitened likelihood ratio"
    threshold = 2130.0
    scored_in = "1"
    Numbers, State = GlrNumbers, GlrState
    numbers: ClassVar[dict[str, float]] = {
        "least_load": 1600.0,
        "most_lost": 0.0,
        "colour_1": 0.76,
        "colour_2": 0.22,
        "sd": 47.0,
    }
