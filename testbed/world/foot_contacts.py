"""Where the robot touches the ground, as the engine sees it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from testbed.formats.arrays import Array

BODY_A, LINK_A, LINK_B, NORMAL_ON_B, DISTANCE, NORMAL_FORCE = 1, 3, 4, 7, 8, 9
"""Places in a row of the engine's contacts, a tuple. Its normal points from body B to body A."""
FRICTIONS = ((10, 11), (12, 13))
"""Places of both friction forces and their directions in such a row."""


class FootContacts:
    """Contacts of one engine client, `bullet`, between its robot and the ground under each foot.

    links: link of a foot -> its number in leg order; grounds: body of the ground under each foot.
    """

    def __init__(
        self, bullet: Any, robot: int, links: Mapping[int, int], grounds: Sequence[int]
    ) -> None:
        self._all, self._closest = bullet.getContactPoints, bullet.getClosestPoints
        self._robot, self._feet, self._links, self._grounds = robot, links, list(links), grounds

    def forces(self, foot_force: Array, normal_force: Array) -> float:
        """Sum contacts per foot: force of the ground on the foot (4, 3), world frame, and its
        normal part (4), N.

        Returns the normal force on everything else of the robot (belly), N.
        """
        foot_force[:] = 0.0
        normal_force[:] = 0.0
        elsewhere = 0.0
        # Asked for one body's contacts the engine turns the normal round where that body is second,
        # but not the friction. So all contacts are fetched as they are, and turned here as a whole.
        (rub, rub_along), (skew, skew_along) = FRICTIONS
        for row in self._all():
            size_n = row[NORMAL_FORCE]
            if size_n == 0.0:
                continue
            robot_is_a = row[BODY_A] == self._robot
            foot = self._feet.get(row[LINK_A] if robot_is_a else row[LINK_B])
            if foot is None:
                elsewhere += size_n
                continue
            sign = 1.0 if robot_is_a else -1.0
            push_n, rub_n, skew_n = sign * size_n, sign * row[rub], sign * row[skew]
            total = foot_force[foot]
            for axis in range(3):
                total[axis] += (
                    push_n * row[NORMAL_ON_B][axis]
                    + rub_n * row[rub_along][axis]
                    + skew_n * row[skew_along][axis]
                )
            normal_force[foot] += abs(push_n)
        return elsewhere

    def normals(self, normals: Array) -> None:
        """Overwrite rows of (4, 3) by the ground's direction under the feet that touch it: the mean
        over the force.
        """
        total = [[0.0, 0.0, 0.0] for _ in self._feet]
        for row in self._all():
            robot_is_a, size_n = row[BODY_A] == self._robot, row[NORMAL_FORCE]
            foot = self._feet.get(row[LINK_A] if robot_is_a else row[LINK_B])
            if foot is not None and size_n > 0.0:
                for axis, part in enumerate(row[NORMAL_ON_B]):
                    total[foot][axis] += part * size_n if robot_is_a else -part * size_n
        for foot, (x, y, z) in enumerate(total):
            size = math.sqrt(x * x + y * y + z * z)
            if size > 0.0:
                normals[foot] = x / size, y / size, z / size

    def elsewhere(self, ground: int) -> tuple[float, int]:
        """How far the ground is from what of the robot is no foot, m, negative inside it (inf: it
        is nowhere near), and the link (-1: the body) that is nearest.
        """
        near = self._closest(self._robot, ground, 0.0)
        others = [
            (float(row[DISTANCE]), int(row[LINK_A]))
            for row in near
            if row[LINK_A] not in self._feet
        ]
        return min(others, default=(math.inf, -1))

    def gap(self, leg: int, reach_m: float = 1.0) -> tuple[float, Array]:
        """Distance of a foot from its ground, m (inf: none), negative inside it, and the ground's
        normal there (3).
        """
        points = self._closest(
            self._robot, self._grounds[leg], reach_m, linkIndexA=self._links[leg]
        )
        if not points:
            return math.inf, np.zeros(3)
        nearest = min(points, key=lambda row: row[DISTANCE])
        return float(nearest[DISTANCE]), np.array(nearest[NORMAL_ON_B])
