"""Where the robot touches the ground, as the engine sees it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from testbed.formats.arrays import Array


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
        for row in self._all():
            n = row[9]
            if n == 0.0:
                continue
            first = row[1] == self._robot
            foot = self._feet.get(row[3] if first else row[4])
            if foot is None:
                elsewhere += n
                continue
            sign = 1.0 if first else -1.0
            n, f1, f2 = sign * n, sign * row[10], sign * row[12]
            (nx, ny, nz), (ax, ay, az), (bx, by, bz) = row[7], row[11], row[13]
            total = foot_force[foot]
            total[0] += n * nx + f1 * ax + f2 * bx
            total[1] += n * ny + f1 * ay + f2 * by
            total[2] += n * nz + f1 * az + f2 * bz
            normal_force[foot] += abs(n)
        return elsewhere

    def normals(self, normals: Array) -> None:
        """Overwrite rows of (4, 3) by the ground's direction under the feet that touch it: the mean
        over the force.
        """
        total = [[0.0, 0.0, 0.0] for _ in self._feet]
        for row in self._all():
            first, n = row[1] == self._robot, row[9]
            foot = self._feet.get(row[3] if first else row[4])
            if foot is not None and n > 0.0:
                for index, part in enumerate(row[7]):
                    total[foot][index] += part * n if first else -part * n
        for foot, (x, y, z) in enumerate(total):
            size = math.sqrt(x * x + y * y + z * z)
            if size > 0.0:
                normals[foot] = x / size, y / size, z / size

    def elsewhere(self, ground: int) -> tuple[float, int]:
        """How far the ground is from what of the robot is no foot, m, negative inside it (inf: it
        is nowhere near), and the link (-1: the body) that is nearest.
        """
        near = self._closest(self._robot, ground, 0.0)
        others = [(float(row[8]), int(row[3])) for row in near if row[3] not in self._feet]
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
        nearest = min(points, key=lambda row: row[8])
        return float(nearest[8]), np.array(nearest[7])
