"""The ground around a run's path as heights on a grid: what the moving picture and the plan view
draw.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from testbed.formats.arrays import Array
from testbed.scenario.terrain import Terrain
from testbed.world.ground.terrain import make_ground

CELL_M, ROOM_M, MOST_CELLS = 0.2, 1.6, 60


class Heights(NamedTuple):
    """Heights off the mean slope, m, at x0 + i cell, y0 + j cell of the slope's frame."""

    x0_m: float
    y0_m: float
    cell_m: float
    values_m: Array
    """(rows along x, columns along y)"""


def heights_around(terrain: Terrain | None, path_m: Array) -> Heights | None:
    """The ground with some room around the points (n, 2) that were stepped on; None where it is a
    plane.
    """
    if terrain is None:
        return None
    ground = make_ground(terrain)
    if ground.flat:
        return None
    low, high = path_m.min(axis=0) - ROOM_M, path_m.max(axis=0) + ROOM_M
    cell = max(CELL_M, float((high - low).max()) / MOST_CELLS)
    counts = np.ceil((high - low) / cell).astype(int) + 1
    x, y = (low[side] + cell * np.arange(counts[side]) for side in (0, 1))
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    values, _ = ground.surface(points)
    return Heights(float(low[0]), float(low[1]), cell, values.reshape(len(x), len(y)))
