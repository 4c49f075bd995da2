"""What is laid over any gait: trims, shifts and orders, the mast's balance, the supervisor. Each is
a function of the inner command.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from testbed.compiled import njit
from testbed.control.gait import Command, Measured, along_vertical
from testbed.formats.arrays import Array
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.robot.model import RobotModel, rotation_from_attitude, small_turn, write_rotation

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
def haul(tension_n: Array, wanted_n: Array, by: Hauling, rates: Array) -> None:
    """Add to the rates (2) of the ropes' unstrained lengths, m/s (- hauls in), what brings tensions
    (2) there, N.
    """
    for index in range(rates.shape[0]):
        excess = tension_n[index] - wanted_n[index]
        if abs(excess) >= by.tolerance_n:
            rates[index] += min(max(by.gain_m_s_n * excess, -by.speed_m_s), by.speed_m_s)


class Trim:
    """Set points moved by hand: offsets on the vertical joints and wanted rope pulls.

    The offsets follow their goals at a limited speed; the traction devices haul or pay out in
    proportion to what a rope's measured tension lacks of its wanted pull. A Layer.
    """

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


SHIFT_SPEED_M_S = 0.2
"""Fastest shift of ROBOCLIMBER (E): what the joints do of it is up to their valves."""
_EACH = len(AXES) // len(LEGS)


class Shift:
    """The body moved along the slope over its feet, laid over a gait: what a force that the
    feet cannot bear may take of the legs instead of dragging the feet.

    The shift follows its goal at a limited speed. Set points move by what the legs' geometry
    asks for at the posture in which the layer began, good to some millimetres within a
    decimetre.

    A Layer.
    """

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


class Orders:
    """What somebody orders by hand: speeds of the ropes, the drill's feed and the hammer's
    share, laid over a gait.

    A Layer.
    """

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


LEARN_S = 1.0
"""The attitude at the start is the mean over this time (E)."""
SMOOTH_S = 0.4
"""Time constant of the tilt that is acted on: the blows shake the inertial unit."""
DEAD_RAD = 1.5e-3
"""Tilt that is left alone (0.09 degrees): below, the valves' dead band would make the body hunt."""
GAIN_1_S = 0.4
"""Speed of the correction per tilt (E)."""
MOST_M = 0.08
"""Furthest that a leg is moved."""


class KeepMast:
    """Keeps the mast at right angles to the slope: the vertical joints turn the body back to
    where it stood at first.

        d extension / dt = gain (turn_y x - turn_x y),  x, y: where the foot stands (body frame)

    The tilt is the turn from the mean attitude of the first second, when the body lies
    parallel to the mean slope, about the body's own axes: on a steep slope a turn about its
    normal changes the roll angle, but tilts nothing. The four heights move as one plane:
    nothing is squeezed, no load goes from one diagonal to the other.

    A Layer that adds the mast's heights to the vertical joints. `feet_in_body` (4, 3) at the
    start, m.
    """

    def __init__(self, feet_in_body: Array) -> None:
        self._arm = feet_in_body[:, :2] - feet_in_body[:, :2].mean(axis=0)
        self._level = np.zeros(3)
        self._ticks = 0
        self._upright, self._turned = np.eye(3), np.empty((3, 3))
        self._tilt = 0.0, 0.0
        self._added = np.zeros(4)
        self._given: Command | None = None
        self._last: Command | None = None
        """What was given and what came of it where the heights were at rest."""

    def over(self, command: Command, t: float, dt: float, measured: Measured) -> Command:
        """See Layer."""
        if t < LEARN_S:
            self._ticks += 1
            self._level += (measured.attitude - self._level) / self._ticks
            self._upright = rotation_from_attitude(self._level)
            return command
        rate = self._rate(measured.attitude, dt)
        if rate is None:
            if command is not self._given or self._last is None:
                self._given = command
                self._last = command.moved(along_vertical(self._added), np.zeros(len(AXES)))
            return self._last
        self._last = None
        self._added = self._added + rate * dt
        return command.moved(along_vertical(self._added), along_vertical(rate))

    def _rate(self, attitude: Array, dt: float) -> Array | None:
        """(4) how fast the heights change, m/s; None where the mast stands as it should."""
        write_rotation(attitude, self._turned)
        seen_x, seen_y, _ = small_turn(self._upright.T @ self._turned)
        share = dt / (SMOOTH_S + dt)
        x, y = self._tilt
        self._tilt = x, y = x + share * (seen_x - x), y + share * (seen_y - y)
        if abs(x) <= DEAD_RAD and abs(y) <= DEAD_RAD:
            return None
        rate = GAIN_1_S * (y * self._arm[:, 0] - x * self._arm[:, 1])
        rate[np.abs(self._added + rate * dt) > MOST_M] = 0.0
        return np.asarray(rate)


LOWER_M_S = 0.003
"""Speed at which a lost foot is lowered (E)."""
PATIENCE_S = 0.2
"""A foot that is lost for this long is lowered (E)."""
LOWEST_M = 0.02
"""Farthest that a foot is lowered below what its program wants (E)."""
CALM_S = 0.5
"""The drill resumes when all feet have carried for this long (E)."""


class Supervisor:
    """Watches the contact states: a foot that has lost its load stops the drill and is
    lowered until it carries again.

    The drill waits while any foot that is meant to carry has lost its load, and for a moment
    afterwards. Most feet are back once the thrust is gone; one that is not is lowered, slowly
    and one at a time: through oil of 20 MN/m a millimetre too much takes 20 kN off its
    neighbours. What a foot was lowered stays. It sees the detector's contact states and the
    inner command alone.

    `stops` counts how often the drill was made to wait. A Layer.
    """

    def __init__(self) -> None:
        self.stops = 0
        self._offset = np.zeros(len(LEGS))
        self._carried = np.zeros(len(LEGS), dtype=bool)
        self._calm_s = CALM_S
        self._lost_s = np.zeros(len(LEGS))

    def over(self, command: Command, t: float, dt: float, measured: Measured) -> Command:
        """See Layer."""
        carries = measured.contact.astype(bool)
        self._carried = (self._carried | carries) & command.stance
        lost = self._carried & ~carries
        self._watch(bool(lost.any()), dt)
        self._lost_s = np.where(lost, self._lost_s + dt, 0.0)
        step = np.zeros(len(LEGS))
        longest = int(np.argmax(self._lost_s))
        if self._lost_s[longest] >= PATIENCE_S:
            step[longest] = min(LOWER_M_S * dt, LOWEST_M - self._offset[longest])
        self._offset = self._offset + step
        waits = command.hold_drill or self._calm_s < CALM_S
        if waits != command.hold_drill:
            command = replace(command, hold_drill=waits)
        if not self._offset.any():
            return command
        return command.moved(along_vertical(self._offset), along_vertical(step / dt))

    def _watch(self, lost: bool, dt: float) -> None:
        if lost:
            self.stops += int(self._calm_s >= CALM_S)
            self._calm_s = 0.0
        else:
            self._calm_s = min(self._calm_s + dt, CALM_S)
