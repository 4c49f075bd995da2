"""A learned correction of the secure pull: what a small network adds to it once a rope is lost.

The network sees named features of the loss (FEATURES) and answers four numbers in [-1, 1] a
decision (REACH): all zero is the secure pull. Right and left are mirrored, so that what is learnt
when one rope parts holds when the other does.
"""

from __future__ import annotations

import copy
from typing import Self

import numpy as np

from testbed.benchmarks.control_tasks.agents import (
    RAISED_M,
    ROPE_N_M,
    STEP_S,
    Readings,
    Secure,
    Vector,
)
from testbed.control.layers import SHIFT_SPEED_M_S
from testbed.envs.keep import DIAGONAL, FRONT
from testbed.formats.arrays import Array, Flags
from testbed.formats.networks import Network
from testbed.machine.names import LEGS, SIDES

OVER = "secure pull"
"""The entrant that is corrected."""
FEATURES = (
    "lacking: what the ropes lack of the slope's pull, as a share of it",
    "shifted: how far the body has gone up over its feet since the loss, in 0.05 m",
    "slope: its tangent less 1.2, in 0.3",
    "pulled: pull of both ropes before the loss over the slope's, less 1.2, in 0.1",
    "diagonal: load on the diagonal of the lost rope's front foot less the other's, in half of all",
    "front: load on the front feet less the rear's, in half of all",
    "turning: rate about the body's z towards the lost rope, in 0.05 rad/s",
    "since: exp(-time since the loss / 0.3 s)",
    "dragged: how far the rope's stretch says the feet went down, in 0.03 m",
)
"""What the network sees, all of them of about 1."""
REACH = (0.5, 0.008, 0.008, SHIFT_SPEED_M_S)
"""What an answer of 1 adds: pull of the rope that is left over the slope's; how far the diagonal of
the lost rope's front foot and the front are raised, m; speed of the body up the slope, m/s.
"""


class Corrected(Secure):
    """The secure pull with a network's correction after a loss."""

    def __init__(self, network: Network) -> None:
        super().__init__()
        self._network = network
        self._lost_side, self._since_s, self.decisions = 0.0, 0.0, 0
        self._before_n, self._at_loss = 0.0, np.zeros(3)
        """Pull of both ropes when both held; tension and hauled way of the rope that is left and
        the body's shift at the loss.
        """
        self._answer = np.zeros(len(REACH))

    def with_network(self, network: Network) -> Self:
        """The same agent, at the instant where it is, with another network for what comes."""
        other = copy.copy(self)
        other._network, other.decisions = network, 0
        return other

    def act(self, observation: Vector) -> Vector:
        """See Agent."""
        self.decisions += 1
        return super().act(observation)

    def _ready(self, seen: Readings, tension: Array) -> Array:
        self._before_n = float(tension.sum())
        return super()._ready(seen, tension)

    def _left_n(self, seen: Readings, pull: Array) -> float:
        hauled, shift = seen.each("orders.hauled", SIDES), seen["orders.shift"]
        left = int(np.argmax(pull))
        if self._lost_side == 0.0:
            self._lost_side = 1.0 if left == 1 else -1.0
            self._at_loss = np.array([0.5 * self._before_n, hauled[left], shift])
        gone = np.array([pull[left], hauled[left], shift]) - self._at_loss
        self._answer = self._network.answer(self._features(seen, float(pull.sum()), gone)) * REACH
        self._since_s += STEP_S
        return (1.0 + float(self._answer[0])) * self._slope_n

    def _features(self, seen: Readings, pull_n: float, gone: Array) -> Array:
        """(len(FEATURES),) `gone`: gained tension and hauled way of the rope that is left, N and m,
        and the body's shift since the loss, m.
        """
        loads = seen.each("estimate_own", LEGS)
        half_n = 0.5 * max(float(loads.sum()), 1.0)
        gained_n, hauled_m, shifted_m = gone.tolist()
        return np.array(
            [
                1.0 - pull_n / self._slope_n,
                shifted_m / 0.05,
                (self._slope - 1.2) / 0.3,
                (self._before_n / self._slope_n - 1.2) / 0.1,
                self._lost_side * float(DIAGONAL @ loads) / half_n,
                float(FRONT @ loads) / half_n,
                self._lost_side * seen["angular_rate_z"] / 0.05,
                np.exp(-self._since_s / 0.3),
                (gained_n / ROPE_N_M - hauled_m + shifted_m) / 0.03,
            ]
        )

    def _raised_m_s(self, seen: Readings, holds: Flags) -> tuple[float, float]:
        if holds.all():
            return super()._raised_m_s(seen, holds)
        now = np.array([seen["orders.diagonal"], seen["orders.front"]])
        if self._stood_m is None:
            self._stood_m = now
        wanted = self._stood_m + np.array([self._lost_side, 1.0]) * (RAISED_M + self._answer[1:3])
        diagonal, front = ((wanted - now) / STEP_S).tolist()
        return diagonal, front

    def _shifted_m_s(self, seen: Readings, pull: Array) -> float:
        return 0.0 if pull.all() else float(self._answer[3])
