"""The ground: an inclined surface through the world's origin that rises towards +x.

Shapes stand in the slope's frame: x up the slope, y to the left, heights along its normal.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from testbed.formats.arrays import Array
from testbed.scenario.parts import Ropes
from testbed.scenario.terrain import Terrain


def ground_shape(bullet: Any, ground: Ground) -> int:
    """Make the shape of a ground in an engine client; returns the engine's number of it."""
    if ground.kind == "plane":
        return int(bullet.createCollisionShape(bullet.GEOM_PLANE))
    if ground.kind == "box":
        return int(bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=[100, 100, 1]))
    if ground.kind == "profile":  # a box under each straight piece, risers included
        sizes, places, turns = ground.boxes()
        return int(
            bullet.createCollisionShapeArray(
                shapeTypes=[bullet.GEOM_BOX] * len(sizes),
                halfExtents=sizes,
                collisionFramePositions=places,
                collisionFrameOrientations=turns,
            )
        )
    assert ground.heights_m is not None
    rows, columns = ground.heights_m.shape
    return int(
        bullet.createCollisionShape(
            bullet.GEOM_HEIGHTFIELD,
            meshScale=[ground.cell_m, ground.cell_m, 1.0],
            heightfieldData=ground.heights_m.T.ravel().tolist(),
            numHeightfieldRows=rows,
            numHeightfieldColumns=columns,
        )
    )


FIELD_LENGTH_M = 24.0
PROFILE_REACH_M = 60.0
"""How far a profile goes on at its ends, and half its width."""
ANCHOR_HEIGHT_M = 0.5
"""Anchors of the ropes stand this far off the mean slope (E)."""
BOX_M = 0.6
"""Thickness of the boxes that a profile is made of."""


@dataclass(frozen=True)
class Ground:
    """What the feet stand on: a plane, heights on a grid (rows along x, columns along y), a profile
    along x (n, 2).
    """

    kind: str
    slope_rad: float
    friction: float
    stiffness_n_m: float
    damping_n_s_m: float
    cell_m: float = 0.1
    heights_m: Array | None = None
    profile_m: Array | None = None

    @property
    def rotation_slope_to_world(self) -> Array:
        """(3, 3): columns are up-slope, left and the slope's normal, in the world frame."""
        s, c = math.sin(self.slope_rad), math.cos(self.slope_rad)
        return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])

    @property
    def normal_in_world(self) -> Array:
        """(3): the mean surface's normal, away from the rock."""
        return np.asarray(self.rotation_slope_to_world[:, 2])

    @property
    def flat(self) -> bool:
        """One normal everywhere."""
        return self.heights_m is None and self.profile_m is None

    def surface(self, points_m: Array) -> tuple[Array, Array]:
        """Heights (n), m, and unit normals (n, 3) in the world at points (n, 2) of the slope's
        frame.

        On a grid both are bilinear; at the foot of a step the height is the upper one's.
        """
        n = len(points_m)
        heights, normals = np.zeros(n), np.tile([0.0, 0.0, 1.0], (n, 1))
        if self.heights_m is not None:
            heights, normals[:, 0], normals[:, 1] = _bilinear(self.heights_m, self.cell_m, points_m)
        elif self.profile_m is not None:
            heights, normals[:, 0] = _along_profile(self.profile_m, points_m[:, 0])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        return heights, normals @ self.rotation_slope_to_world.T

    def boxes(self) -> tuple[list[list[float]], list[list[float]], list[list[float]]]:
        """Half edges, centres and quaternions xyzw of boxes whose tops are a profile's straight
        pieces.

        Slope frame; the profile is carried on at its ends, parallel to the slope.
        """
        assert self.profile_m is not None
        reach = np.array([PROFILE_REACH_M, 0.0])
        points = [self.profile_m[0] - reach, *self.profile_m, self.profile_m[-1] + reach]
        sizes, places, turns = [], [], []
        for start, end in itertools.pairwise(points):
            length = float(np.linalg.norm(end - start))
            along = (end - start) / length
            middle = (start + end) / 2 - BOX_M / 2 * np.array([-along[1], along[0]])
            half = -math.atan2(along[1], along[0]) / 2
            sizes.append([length / 2, PROFILE_REACH_M, BOX_M / 2])
            places.append([float(middle[0]), 0.0, float(middle[1])])
            turns.append([0.0, math.sin(half), 0.0, math.cos(half)])
        return sizes, places, turns

    def engine_pose(self, sunk_m: float = 0.0) -> tuple[list[float], list[float]]:
        """Position and quaternion xyzw of the engine's ground body, `sunk_m` below its place along
        the normal.

        The engine centres a height field between its lowest and highest point; a box's top must lie
        on the plane.
        """
        half = self.slope_rad / 2
        rotation = [0.0, -math.sin(half), 0.0, math.cos(half)]
        shift = -sunk_m
        if self.kind == "box":
            shift -= 1.0
        elif self.heights_m is not None:
            shift += 0.5 * float(self.heights_m.min() + self.heights_m.max())
        return (self.normal_in_world * shift).tolist(), rotation


def make_ground(terrain: Terrain) -> Ground:
    """The ground of a scenario."""
    heights, profile = None, None
    if terrain.kind == "heightfield":
        count = round(FIELD_LENGTH_M / terrain.cell_m) + 1
        heights = rough_surface(
            count, count, terrain.cell_m, terrain.roughness_m, terrain.roughness_seed, terrain.hurst
        )
    elif terrain.kind == "elevation":
        from testbed.scenario.elevation import heights_off_slope

        heights = heights_off_slope(terrain)
    elif terrain.kind == "profile":
        profile = np.array(terrain.profile_m, dtype=np.float64)
    return Ground(
        terrain.kind,
        math.radians(terrain.slope_deg),
        terrain.friction,
        terrain.stiffness_n_m,
        terrain.damping_n_s_m,
        terrain.cell_m,
        heights,
        profile,
    )


def anchors_in_world(ropes: Ropes, rotation_slope_to_world: Array) -> Array:
    """Where the left and the right rope hang, world frame, (2, 3), m."""
    half, azimuth = ropes.anchor_spread_m / 2, math.radians(ropes.azimuth_deg)
    up, left = (
        ropes.anchor_distance_m * math.cos(azimuth),
        ropes.anchor_distance_m * math.sin(azimuth),
    )
    local = np.array([[up, left + half, ANCHOR_HEIGHT_M], [up, left - half, ANCHOR_HEIGHT_M]])
    return np.asarray(local @ rotation_slope_to_world.T)


def rough_surface(
    rows: int, columns: int, cell_m: float, sigma_m: float, seed: int, hurst: float = 0.8
) -> Array:
    """Random rock (rows, columns), m: spectrum falling as k^-(2 hurst + 2) in power between 4 m and
    0.3 m waves.
    """
    if sigma_m == 0.0:
        return np.zeros((rows, columns))
    rng = np.random.default_rng(seed)
    kx = np.fft.fftfreq(rows, cell_m)[:, None]
    ky = np.fft.fftfreq(columns, cell_m)[None, :]
    k = np.hypot(kx, ky)
    band = (k > 1 / 4.0) & (k < 1 / 0.3)
    amplitude = np.where(band, np.where(k > 0, k, 1.0) ** -(hurst + 1.0), 0.0)
    field = np.fft.ifft2(np.fft.fft2(rng.standard_normal((rows, columns))) * amplitude).real
    return np.asarray(field / field.std() * sigma_m)


def _bilinear(heights: Array, cell_m: float, points: Array) -> tuple[Array, Array, Array]:
    """Height and its negative derivatives along x and y at points (n, 2), the grid's middle at the
    origin.
    """
    place = points / cell_m + (np.array(heights.shape) - 1) / 2.0
    first = np.clip(np.floor(place).astype(int), 0, np.array(heights.shape) - 2)
    u, v = np.clip(place - first, 0.0, 1.0).T
    i, j = first.T
    a, b, c, d = heights[i, j], heights[i + 1, j], heights[i, j + 1], heights[i + 1, j + 1]
    height = (1 - u) * (1 - v) * a + u * (1 - v) * b + (1 - u) * v * c + u * v * d
    return (
        height,
        -((1 - v) * (b - a) + v * (d - c)) / cell_m,
        -((1 - u) * (c - a) + u * (d - b)) / cell_m,
    )


def _along_profile(profile: Array, x: Array) -> tuple[Array, Array]:
    """Height and its negative derivative along x; level beyond the ends."""
    k = np.searchsorted(profile[:, 0], x, side="right")
    inside = (k > 0) & (k < len(profile))
    k = np.clip(k, 1, len(profile) - 1)
    (x0, z0), (x1, z1) = profile[k - 1].T, profile[k].T
    rise = np.where(inside, (z1 - z0) / np.where(x1 > x0, x1 - x0, 1.0), 0.0)
    height = np.where(
        inside, z0 + rise * (x - x0), np.where(x < profile[0, 0], profile[0, 1], profile[-1, 1])
    )
    return height, -rise
