"""Closed-form kinematics of the cylindrical legs: feet from joints and joints from feet, in the body frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

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
        out: list[float] = []
        for leg, foot in enumerate(feet.tolist()):
            out += self.leg_joints(leg, foot)
        return np.array(out)

    def leg_joints(self, leg: int, foot: Sequence[float]) -> tuple[float, float, float]:
        """Joints of one leg, rad and m, that put its foot (3) there; no range is checked."""
        hip_x, hip_y, direction = self._legs[leg]
        x, y = foot[0] - hip_x, foot[1] - hip_y
        turn = (math.atan2(y, x) - direction + math.pi) % (2.0 * math.pi) - math.pi
        return turn, math.hypot(x, y) - self.offset_m, self.retracted_m - foot[2]

    def leg_foot(self, leg: int, joints: Sequence[float]) -> tuple[float, float, float]:
        """Underside of one foot, m, from its leg's joints (3), rad and m."""
        hip_x, hip_y, direction = self._legs[leg]
        angle, reach = direction + joints[0], self.offset_m + joints[1]
        return hip_x + reach * math.cos(angle), hip_y + reach * math.sin(angle), self.retracted_m - joints[2]

    @cached_property
    def _legs(self) -> list[tuple[float, float, float]]:
        """Hip x and y, neutral direction of each leg."""
        return [
            (x, y, turn) for (x, y, _), turn in zip(self.hips_m.tolist(), self.directions_rad.tolist(), strict=True)
        ]
