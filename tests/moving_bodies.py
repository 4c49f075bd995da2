"""Where the engine's bodies are and how they move, asked of the engine itself."""

from __future__ import annotations

from typing import Any

import numpy as np


def link_position(engine: Any, link: int) -> np.ndarray:
    """Centre of mass (3) of a link in the world, m; -1 is the base."""
    if link < 0:
        return np.array(engine.bullet.getBasePositionAndOrientation(engine.robot)[0])
    return np.array(engine.bullet.getLinkState(engine.robot, link)[0])


def momentum(engine: Any) -> tuple[np.ndarray, np.ndarray]:
    """Linear momentum (3), N s, and angular momentum about the world's origin (3), N m s, of the
    whole robot.
    """
    bullet, robot = engine.bullet, engine.robot
    linear, angular = np.zeros(3), np.zeros(3)
    for link in range(-1, bullet.getNumJoints(robot)):
        info = bullet.getDynamicsInfo(robot, link)
        mass, inertia = info[0], np.diag(info[2])
        if link < 0:
            position, orientation = bullet.getBasePositionAndOrientation(robot)
            velocity, rate = bullet.getBaseVelocity(robot)
        else:
            state = bullet.getLinkState(robot, link, 1, 1)
            position, orientation, velocity, rate = state[0], state[1], state[6], state[7]
        turn = np.array(bullet.getMatrixFromQuaternion(orientation)).reshape(3, 3)
        part = mass * np.array(velocity)
        linear += part
        angular += np.cross(position, part) + turn @ inertia @ turn.T @ np.array(rate)
    return linear, angular
