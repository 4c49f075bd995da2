"""Small networks, trained on the benchmark's tuning scenes alone, on what views show of a foot.

    score = w_2 tanh(W_1 tanh(W_0 view + b_0) + b_1) + b_2

the log of the odds that the foot has lost its contact, smoothed over some milliseconds: the mean of
MEMBERS networks that were trained apart, side by side in one (W_1 is of blocks). The weights lie in
learned.npz beside this file; `testbed lab train-detector` makes them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.errors import InputError
from testbed.estimation.detectors.base import Hold
from testbed.estimation.detectors.foot_view import VIEW, FootMemory, View, ViewNumbers, update_views
from testbed.estimation.detectors.sample import Sample
from testbed.formats.arrays import Array
from testbed.formats.networks import Network, read_network
from testbed.formats.records import Record, Records, part, quantity
from testbed.machine.names import LEGS

MEMBERS = 6
WIDE_OF_ONE, NARROW_OF_ONE = 24, 12
WIDE, NARROW = MEMBERS * WIDE_OF_ONE, MEMBERS * NARROW_OF_ONE
"""Sizes of the two inner layers, of one member and of all."""
WEIGHTS = Path(__file__).with_name("learned.npz")


class LearnedNumbers(Record):
    """The weights and the scale."""

    scale = part(ViewNumbers, "of the machine")
    smooth = quantity("s", "time constant of the score")
    weight_0 = quantity("1", "W_0", per=(WIDE, len(VIEW)))
    bias_0 = quantity("1", "b_0", per=WIDE)
    weight_1 = quantity("1", "W_1", per=(NARROW, WIDE))
    bias_1 = quantity("1", "b_1", per=NARROW)
    weight_2 = quantity("1", "w_2", per=NARROW)
    bias_2 = quantity("1", "b_2")


@cache
def shipped_network() -> Network:
    """The weights of learned.npz. Raises InputError for a file that is none or of another shape."""
    found, _ = read_network(WEIGHTS)
    sizes = [weight.shape for weight, _ in found.layers]
    if sizes != [(WIDE, len(VIEW)), (NARROW, WIDE), (1, NARROW)]:
        raise InputError("is no network of the learned detector", file=WEIGHTS, value=sizes)
    return found


def numbers_of(weights: Network, scale: Mapping[str, float], smooth_s: float) -> NDArray[Any]:
    """`LearnedNumbers` (1,) of a network, a machine's scale (`ViewNumbers`) and the time constant
    of the score, s.
    """
    out = LearnedNumbers.zeros()
    out["scale"], out["smooth"] = ViewNumbers.one(**scale), smooth_s
    for k, (weight, bias) in enumerate(weights.layers):
        last = k == len(weights.layers) - 1
        out[f"weight_{k}"] = weight[0] if last else weight
        out[f"bias_{k}"] = bias[0] if last else bias
    return out


@njit
def answer(view: Array, numbers: LearnedNumbers, wide: Array) -> float:
    """Log odds that a foot with this view is lost, mean of the members'; `wide` (WIDE) is
    scratch.
    """
    for i in range(WIDE):
        total = numbers.bias_0[i]
        for k in range(view.shape[0]):
            total += numbers.weight_0[i, k] * view[k]
        wide[i] = math.tanh(total)
    odds = numbers.bias_2
    for j in range(NARROW):
        total, first = numbers.bias_1[j], j // NARROW_OF_ONE * WIDE_OF_ONE
        for i in range(first, first + WIDE_OF_ONE):
            total += numbers.weight_1[j, i] * wide[i]
        odds += numbers.weight_2[j] * math.tanh(total)
    return odds


@njit
def _judge(
    samples: Records[Sample],
    numbers: Records[LearnedNumbers],
    memories: Records[FootMemory],
    dt: float,
    views: Records[View],
    table: Array,
    scores: Array,
) -> None:
    """Scores (n, 4) of samples (n,); views (4): scratch, and the same as a table."""
    wide = np.empty(WIDE)
    share = dt / (numbers[0].smooth + dt)
    for n in range(samples.shape[0]):
        sample = samples[n]
        update_views(sample.row, sample.derived, numbers[0].scale, memories, dt, views)
        for foot in range(len(LEGS)):
            memory, odds = memories[foot], answer(table[foot], numbers[0], wide)
            if memory.judged == 0.0:
                memory.odds, memory.judged = odds, 1.0
            memory.odds += share * (odds - memory.odds)
            scores[n, foot] = memory.odds


class Learned:
    """See the module. `scale`: another machine's numbers, by name; 294.3 N are 0.03 of a quarter of
    4 t, the lengths those of ROBOCLIMBER's stance (B).
    """

    name, text = "learned", "small networks on memories of all feet, three levels"
    smooth_s: ClassVar[float] = 0.005
    """Time constant of the score."""
    threshold = 1.85
    hold = Hold(margin=2.1, dwell_s=0.2, sure_margin=4.95, sure_s=0.008)

    scale: ClassVar[dict[str, float]] = {
        "loss_force": 294.3,
        "half_length": 1.25,
        "half_width": 1.0,
    }

    def __init__(self, weights: Network | None = None, **scale: float) -> None:
        found = shipped_network() if weights is None else weights
        self._numbers = numbers_of(found, self.scale | scale, self.smooth_s)
        self._one, self._scores = Sample.zeros(), np.zeros((1, len(LEGS)))
        self._views = View.zeros(len(LEGS))
        self.start(1.0e-3)

    def scaled(self, force: float) -> Self:
        """The same for a machine whose forces are so many times as large, and lengths with their
        cube root.
        """
        length = math.cbrt(force)
        factors = {"loss_force": force, "half_length": length, "half_width": length}
        scale = {name: factors[name] * value for name, value in self.scale.items()}
        return type(self)(None, **scale)

    def start(self, dt_s: float) -> None:
        """Forget everything; `dt_s` lies between two samples."""
        self._dt_s, self._memories = dt_s, FootMemory.zeros(len(LEGS))

    def update(self, sample: Any) -> Array:
        """Scores (4,) of this sample."""
        self._one[:] = np.frombuffer(sample, self._one.dtype)
        self._judge(self._one, self._scores)
        return np.array(self._scores[0])

    def scores(self, samples: NDArray[Any]) -> Array:
        """`update` over samples (n,): (n, 4)."""
        out = np.empty((len(samples), len(LEGS)))
        samples = np.asarray(samples).view(Sample.dtype)
        self._judge(samples, out)
        return out

    def _judge(self, samples: NDArray[Any], scores: Array) -> None:
        table = View.as_table(self._views)
        _judge(samples, self._numbers, self._memories, self._dt_s, self._views, table, scores)


class Patient(Learned):
    """The learned score for one who wants few alarms: a foot is called lost once that is
    far surer, and loaded again later. It finds fewer short losses, and touchdowns later.
    """

    name, text = "patient", "the same networks, surer before they speak"
    smooth_s = 0.014
    threshold = 2.5
    hold = Hold(margin=4.7, dwell_s=0.2, sure_margin=6.4, sure_s=0.02)
