"""Elevation files (npy, Esri ASCII grids, GeoTIFF) as heights on a regular grid, and such a grid
seen from its mean slope: the plane through it, and the heights off that plane.

Uphill is +x. The plane is fitted by least squares to the points around the robot's place; the
heights off it, along its normal, stand on a regular grid again, found point by point by Newton's
method on the interpolated surface.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from testbed.errors import InputError, extra
from testbed.formats.arrays import Array
from testbed.scenario.terrain import Terrain

ENDINGS = ".npy, .asc, .tif or .tiff"
NPY_CELL_M = 0.1
MOST_BYTES = 400_000_000
"""Of an elevation file: 50 million heights."""


@dataclass(frozen=True)
class Grid:
    """Heights (nx, ny), m; x east (or up the slope) along the rows, y north (or left) along the
    columns.
    """

    heights_m: Array
    cell_m: float
    corner_m: tuple[float, float]
    """Coordinates of the point [0, 0]."""

    @property
    def x_m(self) -> Array:
        """Coordinates of the rows."""
        return np.asarray(self.corner_m[0] + self.cell_m * np.arange(self.heights_m.shape[0]))

    @property
    def y_m(self) -> Array:
        """Coordinates of the columns."""
        return np.asarray(self.corner_m[1] + self.cell_m * np.arange(self.heights_m.shape[1]))


def read_elevation(path: str | Path, cell_m: float | None = None) -> Grid:
    """The heights of a file; points without data are nan. `cell_m` is for .npy alone (default 0.1
    m).

    Raises InputError for a file that is missing, of another kind or not such a grid.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in (".npy", ".asc", ".tif", ".tiff"):
        raise InputError(
            "is no elevation file that can be read", file=path, value=ending, allowed=ENDINGS
        )
    if not path.is_file():
        raise InputError("no such file", file=path, field="terrain.elevation.file", allowed=ENDINGS)
    if path.stat().st_size > MOST_BYTES:
        raise InputError("is too large", file=path, allowed=f"at most {MOST_BYTES} bytes")
    if ending != ".npy" and cell_m is not None:
        raise InputError(
            "is given by the file itself",
            file=path,
            field="terrain.elevation.cell_m",
            value=cell_m,
            allowed="nothing but for .npy",
        )
    if ending == ".npy":
        grid = _npy(path, NPY_CELL_M if cell_m is None else cell_m)
    else:
        grid = _esri(path) if ending == ".asc" else _geotiff(path)
    if min(grid.heights_m.shape) < 4:
        raise InputError(
            "has too few points", file=path, value=grid.heights_m.shape, allowed="4 x 4 at least"
        )
    return grid


def _npy(path: Path, cell_m: float) -> Grid:
    try:
        # mapped, a header that promises more than the file holds is refused before memory is taken
        heights = np.load(path, allow_pickle=False, mmap_mode="r")
    except (ValueError, OSError, EOFError, OverflowError) as error:
        raise InputError("is no array of numbers", file=path) from error
    if heights.ndim != 2 or heights.dtype.kind not in "fiu":
        raise InputError(
            "is no grid of heights",
            file=path,
            value=f"{heights.dtype} {heights.shape}",
            allowed="a real array of two dimensions",
        )
    return Grid(heights.astype(np.float64), cell_m, (0.0, 0.0))


def _esri(path: Path) -> Grid:
    """Esri ASCII grid: header lines, then rows from north to south."""
    head: dict[str, float] = {}
    try:
        lines = path.read_text().splitlines()
        while lines and lines[0].split() and lines[0].split()[0][0].isalpha():
            key, value = lines.pop(0).split()
            head[key.lower()] = float(value)
        rows = np.array([[float(word) for word in line.split()] for line in lines if line.strip()])
    except (ValueError, UnicodeDecodeError, IndexError) as error:
        raise InputError(
            "is no Esri ASCII grid", file=path, allowed="header lines `name value`, then rows"
        ) from error
    for name in ("ncols", "nrows", "cellsize"):
        if name not in head:
            raise InputError("is missing in the header", file=path, field=name)
    if rows.shape != (int(head["nrows"]), int(head["ncols"])):
        raise InputError(
            "does not hold what its header says",
            file=path,
            value=rows.shape,
            allowed=f"{head['nrows']:g} rows of {head['ncols']:g}",
        )
    rows[rows == head.get("nodata_value", -9999.0)] = np.nan
    cell = head["cellsize"]
    if not cell > 0:
        raise InputError(
            "is out of range", file=path, field="cellsize", value=cell, allowed="more than 0"
        )
    x = head.get("xllcenter", head.get("xllcorner", 0.0) + cell / 2)
    y = head.get("yllcenter", head.get("yllcorner", 0.0) + cell / 2)
    return Grid(np.ascontiguousarray(rows[::-1].T), cell, (x, y))


def _geotiff(path: Path) -> Grid:
    rasterio = extra("rasterio", "geo", file=path)
    try:
        with rasterio.open(path) as data:
            rows, transform = (
                data.read(1, masked=True).astype(np.float64).filled(np.nan),
                data.transform,
            )
            metres = data.crs is None or not data.crs.is_geographic
    except rasterio.errors.RasterioError as error:
        raise InputError("is no GeoTIFF", file=path) from error
    if not metres or transform.b or transform.d or not np.isclose(transform.a, -transform.e):
        raise InputError(
            "is not on a square grid in metres that looks north",
            file=path,
            allowed="a projected coordinate system with square cells",
        )
    corner = (transform.c + transform.a / 2, transform.f + transform.e * (rows.shape[0] - 0.5))
    return Grid(
        np.ascontiguousarray(rows[::-1].T), float(transform.a), (float(corner[0]), float(corner[1]))
    )


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
"""Steepest mean slope of an elevation file, deg."""


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
