"""Momentum observer (De Luca) on the sliding frame: the external force without differentiating the
velocity.

    r = K ( integral (balance - F_f(v) - r) dt - m v ),   dr/dt = K (F_ext - r)

balance = pA A_A - pB A_B + m g, F_f the published friction (5), F_ext the ground's push. The score
is -r, N.
"""

from __future__ import annotations

from typing import Any, ClassVar

from testbed.compiled import njit
from testbed.estimation.detectors.base import CompiledDetector
from testbed.formats.records import Record, quantity


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
def step(sample: Any, foot: int, numbers: Any, state: Any, dt_s: float) -> float:
    """One sample of one foot."""
    derived = sample.derived
    force = derived.balance[foot] - derived.published[foot]
    momentum = numbers.mass * derived.velocity[foot]
    if state.started == 0.0:
        state.integral, state.started = momentum + force / numbers.gain, 1.0
    else:
        state.integral += dt_s * (force - state.residual)
    state.residual = numbers.gain * (state.integral - momentum)
    return float(-state.residual)


class Momentum(CompiledDetector, step=step):
    """With the mass of frame and foot."""

    name, text = "momentum", "momentum observer"
    threshold = 48.5
    Numbers, State = MomentumNumbers, MomentumState
    numbers: ClassVar[dict[str, float]] = {"gain": 150.0, "mass": 91.7}
