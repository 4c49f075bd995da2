"""An elevation grid seen from its mean slope: the plane through it, and the heights off that plane.

Uphill is +x. The plane is fitted by least squares to the points around the robot's place; the
heights off it, along its normal, stand on a regular grid again, found point by point by Newton's
method on the interpolated surface.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.scenario.elevation import Grid, read_elevation
from testbed.scenario.terrain import Terrain

SETTLED_M = 1e-5
"""Change of the surface's height at which the search for it ends."""
MOST_OFF_M = 5.0
"""How far a surface may lie off its mean slope."""

LONGEST_M, SHORTEST_M = 12.0, 3.0
"""Half the edge of the patch of ground that is taken: as much as the file has, no less than the
robot needs.
"""
FIT_M = 3.0
"""Half the edge of the square to which the plane is fitted: what the robot's feet reach."""
STEEPEST_DEG = 85.0


def slope_of(terrain: Terrain) -> float:
    """Angle of an elevation's mean slope, deg. Raises InputError where it is beyond what a robot
    can be put on.
    """
    assert terrain.elevation is not None
    if terrain.elevation.frame == "slope":
        return terrain.slope_deg
    grid = read_elevation(terrain.elevation.file, terrain.elevation.cell_m)
    gradient, _ = _plane(grid, *_centre(terrain, grid))
    slope = math.degrees(math.atan(float(np.hypot(*gradient))))
    if slope > STEEPEST_DEG:
        raise InputError(
            "is too steep",
            file=terrain.elevation.file,
            field="terrain.elevation",
            value=round(slope, 1),
            allowed=f"a mean slope of at most {STEEPEST_DEG:g} deg",
        )
    return slope


def heights_off_slope(terrain: Terrain) -> Array:
    """Heights (n, n) off the mean slope on a grid of terrain.cell_m, m: rows up the slope, columns
    to the left.
    """
    spec = terrain.elevation
    assert spec is not None
    grid = read_elevation(spec.file, spec.cell_m)
    x0, y0 = _centre(terrain, grid)
    if spec.frame == "slope":
        gradient, height = np.zeros(2), 0.0
    else:
        gradient, height = _plane(grid, x0, y0)
    tilt = math.atan(float(np.hypot(*gradient)))
    heading = math.atan2(gradient[1], gradient[0])
    up = np.array(
        [math.cos(heading) * math.cos(tilt), math.sin(heading) * math.cos(tilt), math.sin(tilt)]
    )
    left = np.array([-math.sin(heading), math.cos(heading), 0.0])
    normal = np.cross(up, left)
    half = _half_edge(grid, x0, y0, heading, tilt, spec.file)
    steps = math.floor(half / terrain.cell_m)
    along = terrain.cell_m * np.arange(-steps, steps + 1)
    flat = np.array([x0, y0, height]) + along[:, None, None] * up + along[None, :, None] * left
    surface = RegularGridInterpolator(
        (grid.x_m, grid.y_m), grid.heights_m, bounds_error=False, fill_value=None
    )
    off = np.zeros(flat.shape[:2])
    for _ in range(60):
        point = flat + off[:, :, None] * normal
        step = (surface(point[:, :, :2]) - point[:, :, 2]) * normal[2]
        off += step
        if np.nanmax(np.abs(step)) < SETTLED_M:
            break
    if not np.isfinite(off).all() or np.abs(off).max() > MOST_OFF_M:
        raise InputError(
            "has holes, overhangs or cliffs around the robot",
            file=spec.file,
            field="terrain.elevation",
            allowed=f"a surface within {MOST_OFF_M:g} m of its mean slope, without gaps",
        )
    return off


def _centre(terrain: Terrain, grid: Grid) -> tuple[float, float]:
    spec = terrain.elevation
    assert spec is not None
    if spec.centre_m is None:
        return float(grid.x_m.mean()), float(grid.y_m.mean())
    x, y = spec.centre_m
    if not (grid.x_m[0] < x < grid.x_m[-1] and grid.y_m[0] < y < grid.y_m[-1]):
        extent = f"{grid.x_m[0]:g} to {grid.x_m[-1]:g} and {grid.y_m[0]:g} to {grid.y_m[-1]:g}"
        raise InputError(
            "lies beside the file's grid",
            file=spec.file,
            field="terrain.elevation.centre_m",
            value=list(spec.centre_m),
            allowed=extent,
        )
    return x, y


def _plane(grid: Grid, x0: float, y0: float) -> tuple[Array, float]:
    """Gradient (2) and height at (x0, y0) of the plane through the points around there."""
    x, y = np.meshgrid(grid.x_m - x0, grid.y_m - y0, indexing="ij")
    reach = max(FIT_M, 2.5 * grid.cell_m)
    near = (np.abs(x) <= reach) & (np.abs(y) <= reach) & np.isfinite(grid.heights_m)
    if near.sum() < 6:
        raise InputError(
            "has no heights around the robot's place", field="terrain.elevation.centre_m"
        )
    design = np.column_stack([x[near], y[near], np.ones(near.sum())])
    gx, gy, height = np.linalg.lstsq(design, grid.heights_m[near], rcond=None)[0]
    return np.array([gx, gy]), float(height)


def _half_edge(grid: Grid, x0: float, y0: float, heading: float, tilt: float, file: str) -> float:
    """Half the edge of the largest square on the slope whose points all lie over the grid, m."""
    room = np.array(
        [min(x0 - grid.x_m[0], grid.x_m[-1] - x0), min(y0 - grid.y_m[0], grid.y_m[-1] - y0)]
    )
    c, s = abs(math.cos(heading)), abs(math.sin(heading))
    reach = np.array([c * math.cos(tilt) + s, s * math.cos(tilt) + c])
    half = min(LONGEST_M, float((room / reach).min()))
    if half < SHORTEST_M:
        raise InputError(
            "leaves too little ground around the robot",
            file=file,
            field="terrain.elevation.centre_m",
            value=round(half, 2),
            allowed=f"{SHORTEST_M:g} m to each side at least",
        )
    return half
