"""Inverse dynamics by Pinocchio, for comparison."""

from __future__ import annotations

import numpy as np
import pinocchio
from numpy.typing import ArrayLike

from testbed.robot.model import RobotModel


def inverse_dynamics(
    robot: RobotModel,
    positions: ArrayLike,
    velocities: np.ndarray,
    accelerations: np.ndarray,
    gravity_in_body: ArrayLike,
) -> np.ndarray:
    """Generalised forces (18,) that produce accelerations (18,) at velocities (18,), gravity included.

    Body velocity and acceleration are those of the body's origin, resolved in the body frame (the acceleration is the
    derivative of these components, so a turning body adds omega x v by itself).
    """
    model = robot._model
    model.gravity.linear = np.asarray(gravity_in_body, dtype=float)
    speed, change = np.empty(18), np.empty(18)
    speed[robot._order], change[robot._order] = velocities, accelerations
    force = pinocchio.rnea(model, robot._data, robot._full(positions), speed, change)
    return np.asarray(force[robot._order])
