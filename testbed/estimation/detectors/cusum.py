"""CUSUM (Page): the log-likelihood ratio of `no load` against `little load`, added up while it
speaks for the loss.

    S = max(0, S + (m1 - m0) / s^2 (L - (m0 + m1) / 2)),   m1 = 0 N lost, m0 = the least load still
    carried

One sample adds no more than `limit`, so that a spike alone is no alarm. In nats.
"""

from __future__ import annotations

from typing import Any, ClassVar

from testbed.compiled import njit
from testbed.estimation.detectors.base import CompiledDetector
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
def step(sample: Any, foot: int, numbers: Any, state: Any, dt_s: float) -> float:
    """One sample of one foot."""
    m0 = numbers.least_load
    gain = -m0 / (numbers.sd * numbers.sd) * (sample.row.estimate.own[foot] - 0.5 * m0)
    gain = min(max(gain, -numbers.limit), numbers.limit)
    state.sum = min(max(state.sum + gain, 0.0), HIGHEST)
    return float(state.sum)


class Cusum(CompiledDetector, step=step):
    """On the own estimate. 1600 N is twice the believed break-away force, 620 + 180 N."""

    name, text = "cusum", "CUSUM on the own estimate"
    threshold = 52.56
    scored_in = "1"
    Numbers, State = CusumNumbers, CusumState
    numbers: ClassVar[dict[str, float]] = {"least_load": 1600.0, "sd": 300.0, "limit": 2.0}
