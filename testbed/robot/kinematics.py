"""Closed-form kinematics of the cylindrical legs: feet from joints and joints from feet, in the body frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from testbed.parameters.names import LEGS
from testbed.parameters.provenance import Parameters
from testbed.robot.urdf import hip_m, radial_direction_rad

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LegKinematics:
    """The four legs: hips (4, 3) m, neutral directions (4) rad, offset and retracted height m (body frame)."""

    hips_m: Array
    directions_rad: Array
    offset_m: float
    retracted_m: float

    @classmethod
    def from_parameters(cls, p: Parameters) -> LegKinematics:
        """The legs of a parameter file."""
        legs = p["legs"]
        return cls(
            np.array([hip_m(p, leg) for leg in LEGS]),
            np.array([radial_direction_rad(p, leg) for leg in LEGS]),
            legs["radial_offset_m"],
            legs["foot_height_retracted_m"],
        )

    def feet(self, joints: Array) -> Array:
        """Undersides of the feet (4, 3), m, from joints (12), rad and m."""
        q = np.asarray(joints).reshape(4, 3)
        angle, reach = self.directions_rad + q[:, 0], self.offset_m + q[:, 1]
        out = self.hips_m.copy()
        out[:, 0] += reach * np.cos(angle)
        out[:, 1] += reach * np.sin(angle)
        out[:, 2] = self.retracted_m - q[:, 2]
        return out

    def joints(self, feet: Array) -> Array:
        """Joints (12), rad and m, that put the feet (4, 3) there; no range is checked."""
        d = feet - self.hips_m
        out = np.empty((4, 3))
        out[:, 0] = _wrapped(np.arctan2(d[:, 1], d[:, 0]) - self.directions_rad)
        out[:, 1] = np.hypot(d[:, 0], d[:, 1]) - self.offset_m
        out[:, 2] = self.retracted_m - feet[:, 2]
        return out.reshape(12)


def _wrapped(angle: Array) -> Array:
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)
