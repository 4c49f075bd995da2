"""What a detector of contact loss is, and how one is written with a compiled step.

A detector is any class with

    update(sample) -> scores (4,)

A higher score means more certainty that the foot has lost its load; `sample`: see sample.py.
Optional are

    threshold      score from which a foot counts as lost; `testbed contact-loss` chooses it
    hold           a Hold: when a lost foot counts as loaded again
    scaled(force)  the same detector for a machine whose forces are `force` times ROBOCLIMBER's
    start(dt_s)    called before the first sample, with the time between two samples, s

A detector is causal and never gets the truth. The same object works live and on a recording, sample
by sample. Its numbers and its threshold are in its own file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit_over
from testbed.estimation.detectors.sample import Sample
from testbed.formats.arrays import Array
from testbed.formats.records import Record
from testbed.formats.sockets import numbers_of
from testbed.machine.names import LEGS


@dataclass(frozen=True)
class Hold:
    """When a foot that was called lost counts as loaded again: once its score has been `margin` or
    more below the threshold for `dwell_s`, or `sure_margin` or more for `sure_s`, or once the mean
    of the score since the loss, with time constant `slow_s`, is `slow_margin` or more below it.

    A score near the threshold crosses it with every blow of the drill. A hold turns twenty alarms
    into one, at the price of a longer wrong state; its mean ends that of a foot that bears little
    for long, and is never sure.
    """

    margin: float = 0.0
    dwell_s: float = 0.02
    sure_margin: float = math.inf
    sure_s: float = 0.0
    slow_margin: float = math.inf
    slow_s: float = 0.0

    def scaled(self, force: float) -> Hold:
        """This rule for scores in N of a machine whose forces are `force` times as large."""
        return replace(
            self,
            margin=force * self.margin,
            sure_margin=force * self.sure_margin,
            slow_margin=force * self.slow_margin,
        )


D = TypeVar("D")
OF_FORCES = ("N", "kg")
"""Units of quantities that scale with the machine's weight."""
DROP = Hold()
"""Loaded again once the score was below the threshold for the duration of a touchdown."""


class Detector(Protocol):
    """The interface that any detector has to offer."""

    def update(self, sample: Any) -> Array:
        """Scores (4,) of this sample."""
        ...


class CompiledDetector:
    """A detector from a compiled `step(sample, foot, numbers, state, dt_s) -> score`, one foot at a
    time.
    """

    name: ClassVar[str]
    text: ClassVar[str]
    """What it does, in half a sentence."""
    threshold: float
    hold: Hold
    scored_in: ClassVar[str] = "N"
    """Unit of score, threshold and hold: N, or 1 if they do not depend on the machine's size."""
    Numbers: ClassVar[type[Record]]
    State: ClassVar[type[Record]]
    numbers: ClassVar[dict[str, float]]
    """Values of `Numbers`: tuned on the tuning scenes, unless they follow from the machine."""
    _loop: ClassVar[Any]

    def __init_subclass__(cls, step: Any) -> None:
        """Prepare the loop over samples and feet, which is compiled at its first use."""
        cls._loop = staticmethod(njit_over(_detect, step))

    def __init__(self, **numbers: float) -> None:
        self._given = self.numbers | numbers
        self._numbers = self.Numbers.one(**self._given)
        self._one, self._scores = Sample.zeros(), np.zeros((1, len(LEGS)))
        self.start(1.0e-3)

    def scaled(self, force: float) -> Self:
        """The same detector for a machine whose forces and masses are `force` times as large."""
        units = {column.name: column.unit for column in self.Numbers.columns()}
        other = type(self)(
            **{k: force * v if units[k] in OF_FORCES else v for k, v in self._given.items()}
        )
        return scaled_limits(other, force) if self.scored_in in OF_FORCES else other

    def start(self, dt_s: float) -> None:
        """Reset the state; `dt_s`: time between two samples, s."""
        self._dt_s, self._state = dt_s, self.State.zeros(len(LEGS))

    def update(self, sample: Any) -> Array:
        """Scores (4,) of this sample."""
        self._one[:] = np.frombuffer(sample, self._one.dtype)
        self._loop(self._one, self._numbers, self._state, self._dt_s, self._scores)
        return np.array(self._scores[0])

    def scores(self, samples: NDArray[Any]) -> Array:
        """`update` over samples (n,): (n, 4)."""
        out = np.empty((len(samples), len(LEGS)))
        self._loop(
            np.asarray(samples).view(Sample.dtype), self._numbers, self._state, self._dt_s, out
        )
        return out


def scaled_limits(detector: D, force: float) -> D:
    """The detector, whose scores are forces, with its threshold and hold multiplied by `force`."""
    limits: Any = detector
    limits.threshold = force * limits.threshold
    if hasattr(limits, "hold"):
        limits.hold = limits.hold.scaled(force)
    return detector


step: Any = None
"""Placeholder: in `_detect`, njit_over puts the detector's own step in its place."""


def _detect(samples: Any, numbers: Any, state: Any, dt_s: float, scores: Any) -> None:
    for k in range(samples.shape[0]):
        for foot in range(scores.shape[1]):
            scores[k, foot] = step(samples[k], foot, numbers[0], state[foot], dt_s)


def start(detector: Any, dt_s: float) -> None:
    """Call the detector's `start`, if it has one."""
    if hasattr(detector, "start"):
        detector.start(dt_s)


def scaled(detector: Any, force: float) -> Any:
    """The detector for a machine whose forces are `force` times as large; the same object if it has
    no `scaled`.
    """
    return detector.scaled(force) if hasattr(detector, "scaled") else detector


def scores_over(detector: Any, samples: NDArray[Any]) -> Array:
    """The scores (n, 4) of a detector for samples (n,): by its own `scores` if it has one, else
    sample by sample, of copies that it may keep and modify.

    Raises InputError for scores of another shape.
    """
    if hasattr(detector, "scores"):
        whole: Array = numbers_of(
            detector.scores(samples), (len(samples), len(LEGS)), detector, "scores"
        )
        return whole
    handed = samples.copy()
    found = [numbers_of(detector.update(s), (len(LEGS),), detector, "scores") for s in handed]
    return np.array(found).reshape(-1, len(LEGS))
