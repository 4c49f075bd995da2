"""The sockets of motion: a gait says where joints and ropes go, layers change what it says.

    command = gait.command(t, dt, measured)
    for layer in layers: command = layer.over(command, t, dt, measured)

Both are asked once a tick (100 Hz) and see measurements alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from testbed.control.command import Command
from testbed.control.measured import Measured
from testbed.formats.arrays import Array
from testbed.robot.model import RobotModel
from testbed.robot.robot import LegKinematics, Robot


class Gait(Protocol):
    """A motion of the machine as commands over time. One of a user's own is made from a
    BelievedStart.
    """

    def command(self, t: float, dt: float, measured: Measured) -> Command:
        """What is wanted in the tick from t to t + dt, s."""
        ...


class Layer(Protocol):
    """Something laid over a gait: a function of the inner command."""

    def over(self, command: Command, t: float, dt: float, measured: Measured) -> Command:
        """The command with this layer's say in it."""
        ...


@dataclass(frozen=True)
class Layered:
    """A gait with layers over it, the innermost first."""

    gait: Gait
    layers: tuple[Layer, ...]

    def command(self, t: float, dt: float, measured: Measured) -> Command:
        """See Gait."""
        command = self.gait.command(t, dt, measured)
        for layer in self.layers:
            command = layer.over(command, t, dt, measured)
        return command


@dataclass(frozen=True)
class BelievedStart:
    """The machine on its slope when a run begins, as control knows it. Body frame: x up the slope,
    y left, z away.
    """

    robot: Robot
    """Its numbers, masses and leg kinematics as believed."""
    joints: Array
    """(12) AXES order, rad (rotation) and m."""
    load_n: Array
    """(4) normal loads of the feet, LEGS order."""
    rope_tension_n: Array
    """(2) left, right; zeros without ropes."""
    rope_directions_in_body: Array
    """(2, 3) unit vectors from the attachments towards the anchors."""
    anchors_in_body_m: Array
    """(2, 3) as surveyed."""

    @property
    def legs(self) -> LegKinematics:
        """Feet from joints and joints from feet."""
        return self.robot.legs

    @property
    def model(self) -> RobotModel:
        """Masses and geometry, declared payload included."""
        return self.robot.model
