"""Roll, pitch, yaw and quaternions as rotations, and how far a body has turned from another
attitude.
"""

from __future__ import annotations

from math import cos, sin
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from testbed.compiled import njit
from testbed.formats.arrays import Array


def rotation_from_attitude(rpy: Array) -> Array:
    """Rotation body to world (3, 3) of roll, pitch, yaw, rad: Rz(yaw) Ry(pitch) Rx(roll)."""
    out = np.empty((3, 3))
    write_rotation(rpy, out)
    return out


def rotations_of(quaternions: ArrayLike) -> Array:
    """Rotations (..., 3, 3) of unit quaternions xyzw (..., 4), whatever else they hold."""
    x, y, z, w = np.moveaxis(np.asarray(quaternions, dtype=float), -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternions_of(rotations: Array) -> Array:
    """Quaternions xyzw (n, 4) of rotations (n, 3, 3)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(rotations).as_quat())


@njit
def write_rotation(rpy: Any, out: Any) -> None:
    """Fill `out` (3, 3) by the rotation body to world of roll, pitch, yaw (3), rad."""
    cr, cp, cy = cos(rpy[0]), cos(rpy[1]), cos(rpy[2])
    sr, sp, sy = sin(rpy[0]), sin(rpy[1]), sin(rpy[2])
    out[0, 0], out[0, 1], out[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    out[1, 0], out[1, 1], out[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    out[2, 0], out[2, 1], out[2, 2] = -sp, cp * sr, cp * cr


@njit
def small_turn(relative: Any) -> tuple[float, float, float]:
    """Small rotation, rad, about the x, y and z axes of the attitude from which `relative` (3, 3)
    leads to another.

    On a steep slope roll and yaw angles grow together (pitch is near 90 degrees); rotations about
    body axes do not.
    """
    return (
        0.5 * (relative[2, 1] - relative[1, 2]),
        0.5 * (relative[0, 2] - relative[2, 0]),
        0.5 * (relative[1, 0] - relative[0, 1]),
    )
