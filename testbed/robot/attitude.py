"""Roll, pitch and yaw as a rotation, and how far a body has turned from another attitude."""

from __future__ import annotations

from math import cos, sin

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rotation_from_attitude(rpy: Array) -> Array:
    """Rotation body to world (3, 3) of roll, pitch, yaw, rad: Rz(yaw) Ry(pitch) Rx(roll)."""
    roll, pitch, yaw = rpy.tolist()
    cr, cp, cy, sr, sp, sy = cos(roll), cos(pitch), cos(yaw), sin(roll), sin(pitch), sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def turned(start: Array, now: Array) -> Array:
    """Rotation (3,), rad, small, about the start's body axes that leads from rotation `start` (3, 3) to `now`.

    On a steep slope roll and yaw angles grow together (pitch is near 90 degrees); rotations about body axes do not.
    """
    (_, xy, xz), (yx, _, yz), (zx, zy, _) = (start.T @ now).tolist()
    return np.array([0.5 * (zy - yz), 0.5 * (xz - zx), 0.5 * (yx - xy)])
