"""From joint to cylinder: joint 1 has its cylinder on a lever, joints 2 and 3 are their cylinders'
extension.

Joint 1: the rod's pin sits on a lever of length b = `lever_m` on the turntable, the barrel's pin at
a = `body_anchor_m` on the body; the angle between both, seen from the rotation axis, is g =
`angle_neutral_rad` + q. The length between the pins is L(q) = sqrt(a^2 + b^2 - 2 a b cos g), its
derivative dL/dq = a b sin g / L is the moment arm: a cylinder force F (+ pushes, lengthens) turns
the joint with F dL/dq, and the piston moves at dL/dq times the joint's speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from testbed.compiled import njit
from testbed.errors import InputError
from testbed.machine.groups import Cylinder, StraightCylinder
from testbed.machine.model import Machine
from testbed.machine.names import LEGS

Array = NDArray[np.float64]
ROTATION: tuple[int, ...] = tuple(range(0, 3 * len(LEGS), 3))
"""Indices of the four rotation axes among the twelve."""


@njit
def pin_distance_m(
    angle_rad: float, body_anchor_m: float, lever_m: float, angle_neutral_rad: float
) -> float:
    """Distance of the two pins of joint 1, m, at a joint angle, rad (compiled; scalars)."""
    product = body_anchor_m * lever_m * math.cos(angle_neutral_rad + angle_rad)
    return math.sqrt(body_anchor_m**2 + lever_m**2 - 2.0 * product)


@njit
def arm_m(
    angle_rad: float, body_anchor_m: float, lever_m: float, angle_neutral_rad: float
) -> float:
    """Moment arm dL/dq of joint 1, m (metres of piston per radian), at a joint angle, rad
    (compiled; scalars).
    """
    distance: float = pin_distance_m(angle_rad, body_anchor_m, lever_m, angle_neutral_rad)
    return body_anchor_m * lever_m * math.sin(angle_neutral_rad + angle_rad) / distance


@njit
def joint_to_cylinder(positions: Array, geometry: Array, extensions: Array, arms: Array) -> None:
    """Fill `extensions` (12, m) and `arms` (12, m/rad or 1) from joint positions (12, rad and m),
    in AXES order.

    `geometry` is `RotationLinkage.geometry`: (a m, b m, neutral angle rad, length at extension 0
    m).
    """
    for axis in range(positions.shape[0]):
        if axis % 3 == 0:
            angle = positions[axis]
            extensions[axis] = (
                pin_distance_m(angle, geometry[0], geometry[1], geometry[2]) - geometry[3]
            )
            arms[axis] = arm_m(angle, geometry[0], geometry[1], geometry[2])
        else:
            extensions[axis] = positions[axis]
            arms[axis] = 1.0


@dataclass(frozen=True)
class RotationLinkage:
    """Joint 1's cylinder: extension 0 at the joint's lower limit, growing with the angle up to
    `stroke_m`.
    """

    body_anchor_m: float
    lever_m: float
    angle_neutral_rad: float
    lower_rad: float
    upper_rad: float

    @classmethod
    def from_machine(cls, machine: Machine) -> RotationLinkage:
        """The linkage of a machine. Raises InputError if the pins pass a dead centre within the
        range.
        """
        numbers, limits = machine.rotation_linkage, machine.joints.rotation
        linkage = cls(
            numbers.body_anchor_m,
            numbers.lever_m,
            numbers.angle_neutral_rad,
            limits.lower_rad,
            limits.upper_rad,
        )
        first, last = (
            linkage.angle_neutral_rad + linkage.lower_rad,
            linkage.angle_neutral_rad + linkage.upper_rad,
        )
        if not 0.0 < first < last < math.pi:
            raise InputError(
                "reaches a dead centre within the joint's range",
                field="rotation_linkage.angle_neutral_rad",
                value=linkage.angle_neutral_rad,
                allowed="0 < neutral + angle < pi",
            )
        return linkage

    @property
    def closed_length_m(self) -> float:
        """Distance of the pins at extension 0, m."""
        return float(
            pin_distance_m(self.lower_rad, self.body_anchor_m, self.lever_m, self.angle_neutral_rad)
        )

    @property
    def stroke_m(self) -> float:
        """Extension at the joint's upper limit, m."""
        return float(self.extension_m(self.upper_rad))

    @property
    def geometry(self) -> Array:
        """The numbers that `joint_to_cylinder` takes, (4,)."""
        return np.array(
            [self.body_anchor_m, self.lever_m, self.angle_neutral_rad, self.closed_length_m]
        )

    def extension_m(self, angle_rad: ArrayLike) -> Array:
        """Cylinder extension, m, of any array of joint angles, rad."""
        anchor, lever = self.body_anchor_m, self.lever_m
        turned = self.angle_neutral_rad + np.asarray(angle_rad, dtype=float)
        return np.asarray(
            np.sqrt(anchor * anchor + lever * lever - 2 * anchor * lever * np.cos(turned))
            - self.closed_length_m
        )

    def moment_arm_m(self, angle_rad: ArrayLike) -> Array:
        """D extension / d angle, m: torque per newton of cylinder force, for any array of joint
        angles, rad.
        """
        turned = self.angle_neutral_rad + np.asarray(angle_rad, dtype=float)
        across = self.body_anchor_m * self.lever_m * np.sin(turned)
        return np.asarray(across / (self.extension_m(angle_rad) + self.closed_length_m))

    def angle_rad(self, extension_m: ArrayLike) -> Array:
        """Joint angle, rad, of any array of cylinder extensions, m; NaN where the pins cannot be
        that far apart.
        """
        anchor, lever = self.body_anchor_m, self.lever_m
        length = np.asarray(extension_m, dtype=float) + self.closed_length_m
        cosine = (anchor * anchor + lever * lever - length * length) / (2 * anchor * lever)
        inside = np.abs(cosine) <= 1.0
        return np.where(
            inside, np.arccos(np.clip(cosine, -1.0, 1.0)) - self.angle_neutral_rad, np.nan
        )


def stroke_m(cylinder: Cylinder, linkage: RotationLinkage) -> float:
    """Stroke of a cylinder, m: its own, or what the rotation linkage asks of it."""
    return cylinder.stroke_m if isinstance(cylinder, StraightCylinder) else linkage.stroke_m
