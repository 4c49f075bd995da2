"""The ground: an inclined surface through the world's origin that rises towards +x."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
FIELD_LENGTH_M = 24.0


@dataclass(frozen=True)
class Ground:
    """What the feet stand on. `heights_m` (rows along the slope's x, columns along y) stand on the inclined plane."""

    kind: str
    slope_rad: float
    friction: float
    stiffness_n_m: float
    damping_n_s_m: float
    cell_m: float = 0.1
    heights_m: Array | None = None

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
        """One normal everywhere: foot forces follow from the legs' motion (foot_forces.py), not from contact points."""
        return self.heights_m is None

    def engine_pose(self) -> tuple[list[float], list[float]]:
        """Position and quaternion xyzw of the engine's ground body.

        The engine centres a height field between its lowest and highest point; a box's top must lie on the plane.
        """
        half = self.slope_rad / 2
        rotation = [0.0, -math.sin(half), 0.0, math.cos(half)]
        shift = 0.0
        if self.kind == "box":
            shift = -1.0
        elif self.heights_m is not None:
            shift = 0.5 * float(self.heights_m.min() + self.heights_m.max())
        return (self.normal_in_world * shift).tolist(), rotation


def make_ground(
    kind: str,
    slope_deg: float,
    friction: float,
    stiffness_n_m: float,
    damping_n_s_m: float,
    *,
    roughness_m: float = 0.0,
    roughness_seed: int = 0,
    cell_m: float = 0.1,
) -> Ground:
    """The ground of a scenario. `roughness_m` is the standard deviation of the height field's surface."""
    heights = None
    if kind == "heightfield":
        count = round(FIELD_LENGTH_M / cell_m) + 1
        heights = rough_surface(count, count, cell_m, roughness_m, roughness_seed)
    return Ground(kind, math.radians(slope_deg), friction, stiffness_n_m, damping_n_s_m, cell_m, heights)


def rough_surface(rows: int, columns: int, cell_m: float, sigma_m: float, seed: int, hurst: float = 0.8) -> Array:
    """Random rock (rows, columns), m: spectrum falling as k^-(2 hurst + 2) in power between 4 m and 0.3 m waves."""
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
