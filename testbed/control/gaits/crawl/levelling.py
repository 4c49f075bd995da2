"""Small corrections of standing feet's heights and places: keep the body's attitude, share the load
evenly.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.control.measured import Measured
from testbed.formats.arrays import Array, Flags
from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.robot.attitude import rotation_from_attitude, small_turn, write_rotation
from testbed.robot.loads.foot_loads import internal_force_of

LEVEL_GAIN_1_S = 0.3
"""Rate at which standing legs take out a tilt or a turn of the body."""
EVEN_GAIN_M_S_N = 2.0e-8
"""Height rate per newton of difference between the diagonals, while standing (E)."""
SEAT_GAIN_M_S_N = 1.2e-7
"""The same while a foot is seated (E)."""
SEAT_SPEED_M_S = 0.004
"""Fastest change of heights for that."""


class Levelling:
    """Keeps the attitude (3: roll, pitch, yaw, rad) of the beginning. Feet (4, 3) and body (3):
    path frame.
    """

    def __init__(self, attitude_rad: Array, lightness: float, scale: Scale = ROBOCLIMBER) -> None:
        """lightness: the feet's share of the weight; the less they carry, the less a difference of
        loads says.
        """
        self._attitude = rotation_from_attitude(attitude_rad)
        self._ease = scale.speed / scale.force / float(np.sqrt(lightness))
        self._fastest_m_s = scale.speed * SEAT_SPEED_M_S
        self._diagonal: Array = np.zeros(4)
        self._now, self._turned = np.empty((3, 3)), np.empty((3, 3))

    def stand_on(self, feet: Array) -> None:
        """The footholds from which the diagonals are reckoned."""
        self._diagonal = 2.0 * internal_force_of(feet[:, :2])

    def correct(
        self,
        feet: Array,
        body: Array,
        standing: Flags,
        measured: Measured,
        seating: bool,
        dt: float,
    ) -> None:
        """Move the standing feet by what turns the body back, slowly; with all down, share the
        load out between the diagonals too.

        seating: whether a foot is being seated, which goes faster.
        """
        write_rotation(measured.attitude, self._now)
        np.matmul(self._attitude.T, self._now, out=self._turned)
        lift = self._even_out_m(measured.load, seating, dt) if all(standing.tolist()) else 0.0
        move_feet(feet, body, standing, self._turned, LEVEL_GAIN_1_S * dt, self._diagonal, lift)

    def _even_out_m(self, load_n: Array, seating: bool, dt: float) -> float:
        """How far to move along the internal force that shifts load between the diagonals and
        changes nothing else.
        """
        gain = (SEAT_GAIN_M_S_N if seating else EVEN_GAIN_M_S_N) * self._ease
        most = self._fastest_m_s
        return min(max(gain * float(self._diagonal @ load_n), -most), most) * dt


@njit
def move_feet(
    feet: Any, body: Any, standing: Any, turned: Any, share: float, diagonal: Any, lift_m: float
) -> None:
    """Move standing feet (4, 3) by a share of what the body has turned by (3, 3), and along
    `diagonal` (4) by `lift_m`.
    """
    roll, pitch, yaw = small_turn(turned)
    roll, pitch, yaw = share * roll, share * pitch, share * yaw
    for leg in range(feet.shape[0]):
        if standing[leg]:
            x, y = feet[leg, 0] - body[0], feet[leg, 1] - body[1]
            feet[leg, 0] += -yaw * y
            feet[leg, 1] += yaw * x
            feet[leg, 2] += roll * y - pitch * x
            feet[leg, 2] += diagonal[leg] * lift_m
