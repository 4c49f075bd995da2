"""Small corrections of standing feet's heights and places: keep the body's attitude, share the load evenly."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.robot.attitude import rotation_from_attitude, turned
from testbed.robot.foot_load_sets import twist_of

Array = NDArray[np.float64]
LEVEL_GAIN_1_S = 0.3
"""Rate at which standing legs take out a tilt or a turn of the body."""
TWIST_GAIN_M_S_N, SEAT_GAIN_M_S_N = 2.0e-8, 1.2e-7
"""Height rate per newton of difference between the diagonals: while standing, and while a foot is seated."""
SEAT_SPEED_M_S = 0.004
"""Fastest change of heights for that."""


class Levelling:
    """Keeps the attitude (3: roll, pitch, yaw, rad) of the beginning. Feet (4, 3) and body (3): path frame."""

    def __init__(self, attitude_rad: Array, lightness: float) -> None:
        """lightness: the feet's share of the weight; the less they carry, the less a difference of loads says."""
        self._attitude = rotation_from_attitude(attitude_rad)
        self._ease = 1.0 / float(np.sqrt(lightness))
        self._twist: Array = np.zeros(4)

    def stand_on(self, feet: Array) -> None:
        """The footholds from which the diagonals are reckoned."""
        self._twist = 2.0 * twist_of(feet[:, :2])

    def turn_m(self, feet: Array, body: Array, attitude_rad: Array, dt: float) -> Array:
        """(4, 3) moves of standing feet that turn the body back to its first attitude, slowly."""
        turn = LEVEL_GAIN_1_S * dt * turned(self._attitude, rotation_from_attitude(attitude_rad))
        roll, pitch, yaw = turn.tolist()
        moves = [(-yaw * y, yaw * x, roll * y - pitch * x) for x, y, _ in (feet - body).tolist()]
        return np.array(moves)

    def untwist_m(self, load_n: Array, seating: bool, dt: float) -> Array:
        """(4) heights, with all feet down, that move load between the diagonals and change nothing else."""
        gain = (SEAT_GAIN_M_S_N if seating else TWIST_GAIN_M_S_N) * self._ease
        speed = min(max(gain * float(self._twist @ load_n), -SEAT_SPEED_M_S), SEAT_SPEED_M_S)
        return np.asarray(self._twist * (speed * dt))
