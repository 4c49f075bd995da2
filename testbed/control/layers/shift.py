"""The body moved along the slope over its feet, laid over a gait: what a force that the feet cannot
bear may take of the legs instead of dragging the feet.

The shift follows its goal at a limited speed. Set points move by what the legs' geometry asks for
at the posture in which the layer began, good to some millimetres within a decimetre.
"""

from __future__ import annotations

import numpy as np

from testbed.control.command import Command
from testbed.control.measured import Measured
from testbed.formats.arrays import Array
from testbed.machine.names import AXES, LEGS
from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.robot.model import RobotModel

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
