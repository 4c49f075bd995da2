"""Rotations in the engine's form."""

from __future__ import annotations

import numpy as np

from testbed.formats.arrays import Array

NEAR_Y = 0.9
"""An axis that lies as near to y as this cannot be crossed with it."""


def quaternion(rotation: Array) -> Array:
    """Quaternion xyzw of a rotation matrix (3, 3)."""
    r = rotation
    trace = float(np.trace(r))
    squares = np.maximum(np.array([*(1.0 + 2.0 * np.diag(r) - trace), 1.0 + trace]), 0.0)
    k = int(np.argmax(squares))
    products = np.array(
        [
            [squares[0], r[1, 0] + r[0, 1], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
            [r[1, 0] + r[0, 1], squares[1], r[2, 1] + r[1, 2], r[0, 2] - r[2, 0]],
            [r[0, 2] + r[2, 0], r[2, 1] + r[1, 2], squares[2], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], squares[3]],
        ]
    )
    return np.asarray(products[k] / np.linalg.norm(products[k]))


def turning_z_to(axis: Array) -> Array:
    """A rotation matrix (3, 3) whose third column is the unit vector `axis` (3)."""
    x = np.cross([0.0, 1.0, 0.0] if abs(axis[1]) < NEAR_Y else [1.0, 0.0, 0.0], axis)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])
