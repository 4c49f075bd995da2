"""Closed-form kinematics of the cylindrical legs: feet from joints and joints from feet, in the body frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.machine.model import Machine
from testbed.machine.names import LEGS
from testbed.robot.urdf.generate import hip_m, radial_direction_rad

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LegKinematics:
    """The four legs: hips (4, 3) m, neutral directions (4) rad, offset and retracted height m (body frame)."""

    hips_m: Array
    directions_rad: Array
    offset_m: float
    retracted_m: float

    @classmethod
    def from_machine(cls, machine: Machine) -> LegKinematics:
        """The legs of a machine."""
        legs = machine.legs
        return cls(
            np.array([hip_m(machine, leg) for leg in LEGS]),
            np.array([radial_direction_rad(machine, leg) for leg in LEGS]),
            legs.radial_offset_m,
            legs.foot_height_retracted_m,
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
        out = np.empty(3 * len(LEGS))
        joints_of_feet(feet, _NOWHERE, *self.numbers, out)
        return out

    def leg_foot(self, leg: int, joints: Sequence[float]) -> tuple[float, float, float]:
        """Underside of one foot, m, from its leg's joints (3), rad and m."""
        hip_x, hip_y, direction = self._legs[leg]
        angle, reach = direction + joints[0], self.offset_m + joints[1]
        return (
            hip_x + reach * math.cos(angle),
            hip_y + reach * math.sin(angle),
            self.retracted_m - joints[2],
        )

    @cached_property
    def numbers(self) -> tuple[Array, float, float]:
        """What `joints_of_feet` takes: hip x and y and neutral direction of each leg (4, 3), offset and height, m."""
        legs = np.column_stack([self.hips_m[:, :2], self.directions_rad])
        return np.ascontiguousarray(legs), float(self.offset_m), float(self.retracted_m)

    @cached_property
    def _legs(self) -> list[tuple[float, float, float]]:
        """Hip x and y, neutral direction of each leg."""
        return [
            (x, y, turn)
            for (x, y, _), turn in zip(
                self.hips_m.tolist(), self.directions_rad.tolist(), strict=True
            )
        ]


_NOWHERE = np.zeros(3)


@njit
def joints_of_feet(
    feet: Any, body: Any, legs: Any, offset_m: float, retracted_m: float, out: Any
) -> None:
    """Fill `out` (12) by the joints, rad and m, that put the feet (4, 3) there with the body at `body` (3)."""
    for leg in range(legs.shape[0]):
        x, y = feet[leg, 0] - body[0] - legs[leg, 0], feet[leg, 1] - body[1] - legs[leg, 1]
        turn = math.atan2(y, x) - legs[leg, 2] + math.pi
        out[3 * leg] = turn % (2.0 * math.pi) - math.pi
        out[3 * leg + 1] = length(x, y) - offset_m
        out[3 * leg + 2] = retracted_m - (feet[leg, 2] - body[2])


@njit
def length(x: float, y: float) -> float:
    """sqrt(x^2 + y^2), rounded as exactly as Python's math.hypot (its compiled form is a bit off now and then)."""
    rough: float = math.sqrt(x * x + y * y)
    if rough == 0.0:
        return rough
    (x2, x_rest), (y2, y_rest), (r2, r_rest) = exact_square(x), exact_square(y), exact_square(rough)
    both = x2 + y2
    added = both - x2
    rest = (x2 - (both - added)) + (y2 - added) + x_rest + y_rest
    off: float = ((both - r2) + (rest - r_rest)) / (2.0 * rough)
    return rough + off


@njit
def exact_square(v: float) -> tuple[float, float]:
    """v * v as the sum of two numbers (Dekker, Numerische Mathematik 18, 1971)."""
    scaled = v * 134217729.0
    high = scaled - (scaled - v)
    low, square = v - high, v * v
    return square, ((high * high - square) + 2.0 * high * low) + low * low
