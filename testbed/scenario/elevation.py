"""Elevation files: npy, Esri ASCII grids and GeoTIFF, as heights on a regular grid."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from testbed.errors import InputError
from testbed.formats.arrays import Array

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
    try:
        import rasterio
    except ImportError as error:
        way = "pip install 'roboclimber-testbed[geo]'"
        raise InputError("needs the extra `geo`", file=path, allowed=way) from error
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
