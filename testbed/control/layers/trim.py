"""Set points moved by hand: offsets on the vertical joints and wanted rope pulls laid over a gait.

The offsets follow their goals at a limited speed; the traction devices haul or pay out in
proportion to what a rope's measured tension lacks of its wanted pull.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from testbed.compiled import njit
from testbed.control.command import Command, along_vertical
from testbed.control.measured import Measured
from testbed.formats.arrays import Array
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.robot.model import RobotModel

PULL_GAIN_M_S_N = 1.0e-5
"""Rope pay-out speed per newton above the wanted pull: with 330 kN/m of rope a loop of 3.3 1/s
(E).
"""
PULL_SPEED_M_S = 0.06
"""Fastest hauling of the traction devices (E)."""
PULL_TOLERANCE_N = 50.0
"""Within this the traction device rests (about one standard deviation of the load pin) (E)."""
OFFSET_SPEED_M_S = 0.05
"""Fastest change of an offset (E)."""


class Hauling(NamedTuple):
    """How a machine's ropes are brought to wanted tensions."""

    gain_m_s_n: float
    speed_m_s: float
    tolerance_n: float


def hauling(scale: Scale) -> Hauling:
    """That of a machine of this size."""
    return Hauling(
        scale.speed / scale.force * PULL_GAIN_M_S_N,
        scale.speed * PULL_SPEED_M_S,
        scale.force * PULL_TOLERANCE_N,
    )


@njit
def haul(tension_n: Any, wanted_n: Any, by: Hauling, rates: Any) -> None:
    """Add to the rates (2) of the ropes' unstrained lengths, m/s (- hauls in), what brings tensions
    (2) there, N.
    """
    for index in range(rates.shape[0]):
        excess = tension_n[index] - wanted_n[index]
        if abs(excess) >= by.tolerance_n:
            rates[index] += min(max(by.gain_m_s_n * excess, -by.speed_m_s), by.speed_m_s)


class Trim:
    """A Layer; see the module's docstring."""

    def __init__(self, scale: Scale = ROBOCLIMBER) -> None:
        self._hauling, self._offset_m_s = hauling(scale), scale.speed * OFFSET_SPEED_M_S
        self.goal_m: Array = np.zeros(len(LEGS))
        """Wanted offsets of the vertical joints' set points, m, LEGS order."""
        self.pull_n: Array | None = None
        """Wanted tensions of the ropes, N, left, right; None leaves them to the gait."""
        self._offset = np.zeros(len(LEGS))

    def over(self, command: Command, t: float, dt: float, measured: Measured) -> Command:
        """See Layer."""
        most = self._offset_m_s * dt
        step = np.clip(self.goal_m - self._offset, -most, most)
        self._offset = self._offset + step
        if self.pull_n is not None:
            rates = command.rope_rates_m_s.copy()
            haul(measured.rope_tension, self.pull_n, self._hauling, rates)
            command = replace(command, rope_rates_m_s=rates)
        return command.moved(along_vertical(self._offset), along_vertical(step / dt))


# The body moved along the slope over its feet, laid over a gait: what a force that the feet cannot
# bear may take of the legs instead of dragging the feet.
#
# The shift follows its goal at a limited speed. Set points move by what the legs' geometry asks for
# at the posture in which the layer began, good to some millimetres within a decimetre.

SHIFT_SPEED_M_S = 0.2
"""Fastest shift of ROBOCLIMBER (E): what the joints do of it is up to their valves."""
_EACH = len(AXES) // len(LEGS)


class Shift:
    """A Layer; see the module's docstring."""

    def __init__(self, model: RobotModel, scale: Scale = ROBOCLIMBER) -> None:
        self._model, self._fastest_m_s = model, scale.speed * SHIFT_SPEED_M_S
        self.goal_m: Array = np.zeros(2)
        """Wanted shift of the body: up the slope (body x) and to the left (body y), m."""
        self._shift_m = np.zeros(2)
        self._joints_a_metre: Array | None = None
        """(12, 2) set points of a unit shift."""

    def over(self, command: Command, t: float, dt: float, measured: Measured) -> Command:
        """See Layer."""
        if self._joints_a_metre is None:
            self._joints_a_metre = joints_a_metre(self._model, measured.position)
        lacking = self.goal_m - self._shift_m
        most = self._fastest_m_s * dt
        step = lacking * min(1.0, most / max(float(np.linalg.norm(lacking)), 1e-12))
        self._shift_m = self._shift_m + step
        moves = self._joints_a_metre
        return command.moved(moves @ self._shift_m, moves @ step / dt)


def joints_a_metre(model: RobotModel, position: Array) -> Array:
    """(12, 2) how the joints move when the body goes along its x and y and the feet stay, a
    metre.
    """
    jacobians = model.feet(position)[1]
    moves = np.zeros((len(AXES), 2))
    for leg in range(len(LEGS)):
        own = slice(_EACH * leg, _EACH * (leg + 1))
        moves[own] = -np.linalg.inv(jacobians[leg][:, own])[:, :2]
    return moves


# What somebody orders by hand: speeds of the ropes, the drill's feed and the hammer's share, laid
# over a gait.


class Orders:
    """A Layer; see the module's docstring."""

    def __init__(self) -> None:
        self.rope_rates_m_s: Array = np.zeros(len(SIDES))
        """Added to the rates of the ropes' unstrained lengths, left and right; negative hauls
        in.
        """
        self.feed_n: float | None = None
        """See Command."""
        self.hammer = 1.0
        """See Command."""

    def over(self, command: Command, t: float, dt: float, measured: Measured) -> Command:
        """See Layer."""
        return replace(
            command,
            rope_rates_m_s=command.rope_rates_m_s + self.rope_rates_m_s,
            feed_n=self.feed_n,
            hammer=self.hammer,
        )
