"""Classical detectors: CUSUM, a whitened likelihood ratio, two models at once, a momentum observer,
a running mean.

CUSUM (Page): the log-likelihood ratio of `no load` against `little load`, added up while it speaks
for the loss.

    S = max(0, S + (m1 - m0) / s^2 (L - (m0 + m1) / 2))

with m1 = 0 N where the foot is lost and m0 the least load still carried.

One sample adds no more than `limit`, so that a spike alone is no alarm. In nats.
"""

from __future__ import annotations

import math
from typing import ClassVar

from testbed.compiled import njit
from testbed.estimation.detectors.base import CompiledDetector
from testbed.estimation.detectors.sample import Sample
from testbed.formats.records import Record, quantity

HIGHEST = 60.0
"""The sum goes no higher, nats: else it would take as long to come back."""


class CusumNumbers(Record):
    """What is expected of the own estimate."""

    least_load = quantity("N", "m0: the least load still carried")
    sd = quantity("N", "s: standard deviation of the estimate")
    limit = quantity("1", "nats that one sample may add")


class CusumState(Record):
    """Of one foot."""

    sum = quantity("1", "S, nats")


@njit
def cusum_step(
    sample: Sample, foot: int, numbers: CusumNumbers, state: CusumState, dt_s: float
) -> float:
    """One sample of one foot."""
    m0 = numbers.least_load
    gain = -m0 / (numbers.sd * numbers.sd) * (sample.row.estimate.own[foot] - 0.5 * m0)
    gain = min(max(gain, -numbers.limit), numbers.limit)
    state.sum = min(max(state.sum + gain, 0.0), HIGHEST)
    return state.sum


class Cusum(CompiledDetector, step=cusum_step):
    """On the own estimate. 1600 N is twice the believed break-away force, 620 + 180 N."""

    name, text = "cusum", "CUSUM on the own estimate"
    threshold = 52.56
    scored_in = "1"
    Numbers, State = CusumNumbers, CusumState
    numbers: ClassVar[dict[str, float]] = {"least_load": 1600.0, "sd": 300.0, "limit": 2.0}


# Generalised likelihood ratio with the colour of the noise: whitened, then tested over several
# window lengths.
#
# The estimate's error is coloured (hammering, the oil's own ring): L - m = c1 (..)_-1 + c2 (..)_-2
# + e, e white. For the whitened y = L - c1 L_-1 - c2 L_-2 a mean m gives c m, c = 1 - c1 - c2. Over
# the last n samples, with the mean M that fits best,
#
#     T_n = n / (2 s^2) [(c M - c max(M, m0))^2 - (c M - c min(M, m1))^2],   score = max over n
#
# m0 the least load still carried, m1 the most that counts as lost, N. In nats, of either sign.

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
def glr_step(sample: Sample, foot: int, numbers: GlrNumbers, state: GlrState, dt_s: float) -> float:
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


class Glr(CompiledDetector, step=glr_step):
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


# Two models at once: `carries` (the load walks at random, and is no less than m0) and `lost` (the
# load is zero).
#
# Each predicts the next estimate; Bayes' rule and a small chance of changing over between them give
# the odds. Loads are judged with the spread s of estimates, a walk of q N a sample. The score is
# the log of the odds of `lost`, in nats.

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
def multiple_model_step(
    sample: Sample, foot: int, numbers: ModelNumbers, state: ModelState, dt_s: float
) -> float:
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
    return state.odds


class MultipleModel(CompiledDetector, step=multiple_model_step):
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


# Momentum observer (De Luca) on the sliding frame: the external force without differentiating the
# velocity.
#
#     r = K ( integral (balance - F_f(v) - r) dt - m v ),   dr/dt = K (F_ext - r)
#
# balance = pA A_A - pB A_B + m g, F_f the published friction (5), F_ext the ground's push. The
# score is -r, N.


class MomentumNumbers(Record):
    """Of the observer."""

    gain = quantity("1/s", "K")
    mass = quantity("kg", "m: what moves with the vertical joint")


class MomentumState(Record):
    """Of one foot."""

    integral = quantity("N s", "the integral")
    residual = quantity("N", "r")
    started = quantity("1", "1 once there was a sample")


@njit
def momentum_step(
    sample: Sample, foot: int, numbers: MomentumNumbers, state: MomentumState, dt_s: float
) -> float:
    """One sample of one foot."""
    derived = sample.derived
    force = derived.balance[foot] - derived.published[foot]
    momentum = numbers.mass * derived.velocity[foot]
    if state.started == 0.0:
        state.integral, state.started = momentum + force / numbers.gain, 1.0
    else:
        state.integral += dt_s * (force - state.residual)
    state.residual = numbers.gain * (state.integral - momentum)
    return -state.residual


class Momentum(CompiledDetector, step=momentum_step):
    """With the mass of frame and foot."""

    name, text = "momentum", "momentum observer"
    threshold = 48.5
    Numbers, State = MomentumNumbers, MomentumState
    numbers: ClassVar[dict[str, float]] = {"gain": 150.0, "mass": 91.7}


# The simplest rival: the own estimate, smoothed. The score is how far that lies below zero, N.


class SmoothedNumbers(Record):
    """Of the mean."""

    mean_time = quantity("s", "time constant")


class SmoothedState(Record):
    """Of one foot."""

    mean = quantity("N", "the load")
    started = quantity("1", "1 once there was a sample")


@njit
def smoothed_step(
    sample: Sample, foot: int, numbers: SmoothedNumbers, state: SmoothedState, dt_s: float
) -> float:
    """One sample of one foot."""
    own = sample.row.estimate.own[foot]
    share = dt_s / (numbers.mean_time + dt_s) if state.started != 0.0 else 1.0
    state.mean, state.started = state.mean + share * (own - state.mean), 1.0
    return -state.mean


class Smoothed(CompiledDetector, step=smoothed_step):
    """A running mean over 20 ms, as long as a loss must last."""

    name, text = "smoothed", "the own estimate, smoothed over 20 ms"
    threshold = -467.4
    Numbers, State = SmoothedNumbers, SmoothedState
    numbers: ClassVar[dict[str, float]] = {"mean_time": 0.02}
