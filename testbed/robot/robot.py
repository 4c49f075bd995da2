"""A machine with its bodies: numbers, masses and gravity, leg kinematics and linkages, built once
and handed on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.machine.model import Machine
from testbed.machine.names import LEGS
from testbed.robot.linkage import Linkages
from testbed.robot.model import Payload, RobotModel
from testbed.robot.urdf.generate import hip_m, radial_direction_rad

# Closed-form kinematics of the cylindrical legs: feet from joints and joints from feet, in the body
# frame.


@dataclass(frozen=True)
class LegKinematics:
    """The four legs in the body frame: hips (4, 3) m, neutral directions (4) rad, and of each leg
    (4) m, how far its foot is from its hip at radial extension 0 (`offsets_m`) and how high at
    vertical extension 0 (`retracted_m`).
    """

    hips_m: Array
    directions_rad: Array
    offsets_m: Array
    retracted_m: Array

    @classmethod
    def from_machine(cls, machine: Machine) -> LegKinematics:
        """The legs of a machine."""
        legs = machine.each_leg.values()
        return cls(
            np.array([hip_m(machine, leg) for leg in LEGS]),
            np.array([radial_direction_rad(machine, leg) for leg in LEGS]),
            np.array([leg.radial_offset_m for leg in legs]),
            np.array([leg.foot_height_retracted_m for leg in legs]),
        )

    def feet(self, joints: Array) -> Array:
        """Undersides of the feet (4, 3), m, from joints (12), rad and m."""
        angles = np.asarray(joints).reshape(4, 3)
        angle, reach = self.directions_rad + angles[:, 0], self.offsets_m + angles[:, 1]
        out = self.hips_m.copy()
        out[:, 0] += reach * np.cos(angle)
        out[:, 1] += reach * np.sin(angle)
        out[:, 2] = self.retracted_m - angles[:, 2]
        return out

    def joints(self, feet: Array) -> Array:
        """Joints (12), rad and m, that put the feet (4, 3) there; no range is checked."""
        out = np.empty(3 * len(LEGS))
        joints_of_feet(
            feet, self.hips_m, self.directions_rad, self.offsets_m, self.retracted_m, out
        )
        return out

    def leg_foot(self, leg: int, joints: Sequence[float]) -> tuple[float, float, float]:
        """Underside of one foot, m, from its leg's joints (3), rad and m."""
        hip_x, hip_y, direction, offset, retracted = self._legs[leg]
        angle, reach = direction + joints[0], offset + joints[1]
        return (
            hip_x + reach * math.cos(angle),
            hip_y + reach * math.sin(angle),
            retracted - joints[2],
        )

    @cached_property
    def _legs(self) -> list[tuple[float, float, float, float, float]]:
        """Hip x and y, direction, offset and height of each leg, as Python's own numbers."""
        columns = (*self.hips_m.T[:2], self.directions_rad, self.offsets_m, self.retracted_m)
        return list(zip(*(column.tolist() for column in columns), strict=True))


@njit
def joints_of_feet(
    feet: Array, hips: Array, directions: Array, offsets: Array, retracted: Array, out: Array
) -> None:
    """Fill `out` (12) by the joints, rad and m, that put the feet (4, 3) there; the rest as in
    LegKinematics.
    """
    for leg in range(feet.shape[0]):
        x, y = feet[leg, 0] - hips[leg, 0], feet[leg, 1] - hips[leg, 1]
        turn = math.atan2(y, x) - directions[leg] + math.pi
        out[3 * leg] = turn % (2.0 * math.pi) - math.pi
        out[3 * leg + 1] = length(x, y) - offsets[leg]
        out[3 * leg + 2] = retracted[leg] - feet[leg, 2]


@njit
def length(x: float, y: float) -> float:
    """sqrt(x^2 + y^2), rounded as exactly as Python's math.hypot (its compiled form is a bit off
    now and then).
    """
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
def exact_square(value: float) -> tuple[float, float]:
    """A value's square as the sum of two numbers (Dekker, Numerische Mathematik 18, 1971)."""
    scaled = value * 134217729.0
    high = scaled - (scaled - value)
    low, square = value - high, value * value
    return square, ((high * high - square) + 2.0 * high * low) + low * low


@dataclass(frozen=True)
class Robot:
    """What the world is built from, or what estimators and control believe in."""

    machine: Machine
    model: RobotModel
    legs: LegKinematics
    linkages: Linkages
    rope_stiffness_n_m: float | None = None
    """Of each rope as it hangs, EA over its length; None: nobody knows."""
    rope_lengths_m: Array | None = None
    """(2,) from the attachments to the anchors; None: nobody knows."""

    @classmethod
    def of(
        cls,
        machine: Machine,
        carried_kg: float = 0.0,
        rope_height_m: float | None = None,
        bodies: Path | None = None,
    ) -> Robot:
        """A machine with `carried_kg` in its rod store; `rope_height_m`: the ropes' attachments,
        else the URDF's.

        `bodies`: a URDF with other masses than the machine's own.

        Raises InputError for a URDF or linkage that cannot be.
        """
        payload = None
        if carried_kg > 0.0:
            payload = Payload(carried_kg, machine.rod_store_body.position_m)
        return cls(
            machine,
            RobotModel(bodies or machine.urdf, payload, rope_height_m),
            LegKinematics.from_machine(machine),
            Linkages.from_machine(machine),
        )
