"""The simplest rival: the own estimate, smoothed. The score is how far that lies below zero, N."""

from __future__ import annotations

from typing import Any, ClassVar

from testbed.compiled import njit
from testbed.estimation.detectors.base import CompiledDetector
from testbed.formats.records import Record, quantity


class SmoothedNumbers(Record):
    """Of the mean."""

    mean_time = quantity("s", "time constant")


class SmoothedState(Record):
    """Of one foot."""

    mean = quantity("N", "the load")
    started = quantity("1", "1 once there was a sample")


@njit
def step(sample: Any, foot: int, numbers: Any, state: Any, dt_s: float) -> float:
    """One sample of one foot."""
    own = sample.row.estimate.own[foot]
    share = dt_s / (numbers.mean_time + dt_s) if state.started != 0.0 else 1.0
    state.mean, state.started = state.mean + share * (own - state.mean), 1.0
    return float(-state.mean)


class Smoothed(CompiledDetector, step=step):
    """A running mean over 20 ms, as long as a loss must last."""

    name, text = "smoothed", "the own estimate, smoothed over 20 ms"
    threshold = -467.4
    Numbers, State = SmoothedNumbers, SmoothedState
    numbers: ClassVar[dict[str, float]] = {"mean_time": 0.02}
