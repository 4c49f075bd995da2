"""From joint to cylinder: how far a rod is out, and what its force does to the joint.

The twelve axes have a linkage each, of one of three kinds, with q the joint's position and L the
length that it makes of the rod:

    LINEAR    L = s q
    LEVER     L = sqrt(a^2 + b^2 - 2 a b cos g)
    INCLINED  L = s sqrt((q + u)^2 + w^2)

LINEAR is a slide with its cylinder along it, s = 1 (1/2 where a chain doubles the way), or a rack
on a pinion of radius s. LEVER turns: its pins are a from the hinge on the body and b on the
turntable, with an angle g = neutral angle + q between them. INCLINED is a slide with its cylinder
askew beside it: its pins are u apart along the drawn-in slide and w across it.

Extension is L(q) less L at the joint's lower limit. The arm dL/dq turns force into force and speed
into speed: a cylinder force F (+ pushes, lengthens) drives the joint with F dL/dq, and the piston
moves at dL/dq times the joint's speed. All rods lengthen as their joint's position grows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from testbed.compiled import njit
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.records import Record, Records, quantity
from testbed.machine.frame_groups import RotationLinkage, SlideLinkage
from testbed.machine.groups import SlideCylinder
from testbed.machine.model import Axis, Machine
from testbed.machine.names import AXES, JOINTS

LINEAR, LEVER, INCLINED = 0, 1, 2
LEAST_ARM = 0.1
"""A cylinder that stands more across its slide than this pushes the guides, not the slide (E)."""


class Linkage(Record):
    """One cylinder's linkage; what its kind does not have is 0."""

    kind = quantity("1", "LINEAR, LEVER or INCLINED", kind="i8")
    slope = quantity("1", "s: rod by joint (a rack: m/rad)")
    anchor = quantity("m", "a: hinge to the pin on the body")
    lever = quantity("m", "b: hinge to the pin on the turntable")
    neutral = quantity("rad", "g at joint position 0")
    along = quantity("m", "u: distance of the pins along the slide at position 0")
    across = quantity("m", "w: distance of the pins across the slide")
    closed = quantity("m", "L at extension 0")


@njit
def length_of(position: float, linkage: Linkage) -> float:
    """L of a joint position (rad or m), m."""
    if linkage.kind == LEVER:
        product = linkage.anchor * linkage.lever * math.cos(linkage.neutral + position)
        return math.sqrt(linkage.anchor**2 + linkage.lever**2 - 2.0 * product)
    if linkage.kind == INCLINED:
        return linkage.slope * math.sqrt((position + linkage.along) ** 2 + linkage.across**2)
    return linkage.slope * position


@njit
def arm_of(position: float, linkage: Linkage) -> float:
    """DL/dq at a joint position (rad or m): m/rad, or 1."""
    if linkage.kind == LEVER:
        distance = length_of(position, linkage)
        across = linkage.anchor * linkage.lever * math.sin(linkage.neutral + position)
        return across / distance
    if linkage.kind == INCLINED:
        distance = math.sqrt((position + linkage.along) ** 2 + linkage.across**2)
        return linkage.slope * (position + linkage.along) / distance
    return linkage.slope


@njit
def joint_of(extension: float, linkage: Linkage) -> float:
    """Joint position (rad or m) at an extension, m; nan where the pins cannot be that far apart."""
    length = extension + linkage.closed
    if linkage.kind == LEVER:
        squares = linkage.anchor**2 + linkage.lever**2 - length**2
        cosine = squares / (2.0 * linkage.anchor * linkage.lever)
        return math.acos(cosine) - linkage.neutral if abs(cosine) <= 1.0 else math.nan
    if linkage.kind == INCLINED:
        square = (length / linkage.slope) ** 2 - linkage.across**2
        return math.sqrt(square) - linkage.along if square >= 0.0 else math.nan
    return length / linkage.slope


@njit
def joint_to_cylinder(
    positions: Array, linkages: Records[Linkage], extensions: Array, arms: Array
) -> None:
    """Fill `extensions` (n, m) and `arms` (n, m/rad or 1) from joint positions (n, rad and m)."""
    for index in range(positions.shape[0]):
        extensions[index] = length_of(positions[index], linkages[index]) - linkages[index].closed
        arms[index] = arm_of(positions[index], linkages[index])


@njit
def _joint_to_cylinder_rows(
    positions: Array, linkages: Records[Linkage], extensions: Array, arms: Array
) -> None:
    for index in range(positions.shape[0]):
        joint_to_cylinder(positions[index], linkages, extensions[index], arms[index])


@dataclass(frozen=True, eq=False)
class Linkages:
    """The twelve linkages of a machine, in AXES order."""

    records: NDArray[Any]
    """`Linkage` (12,), for compiled callers."""
    limits: Array
    """(12, 2) lower and upper limit of each joint, rad and m."""

    @classmethod
    def from_machine(cls, machine: Machine) -> Linkages:
        """The linkages of a machine. Raises InputError for one that passes a dead centre within its
        joint's range.
        """
        records, limits = Linkage.zeros(len(AXES)), np.empty((len(AXES), 2))
        for record, ends, axis in zip(records, limits, machine.axes.values(), strict=True):
            ends[:] = _limits_of(axis)
            _fill(record, axis.linkage)
            _check_dead_centre(record, ends, axis, machine)
            record["closed"] = length_of(float(ends[0]), record)
        return cls(records, limits)

    def rods(self, joints: ArrayLike) -> tuple[Array, Array]:
        """Extensions, m, and arms, m/rad or 1, of joint positions (12,) or (n, 12), rad and m; of
        their shape.
        """
        positions = np.ascontiguousarray(joints, dtype=float)
        extensions, arms = np.empty_like(positions), np.empty_like(positions)
        rows = (-1, len(AXES))
        _joint_to_cylinder_rows(
            positions.reshape(rows), self.records, extensions.reshape(rows), arms.reshape(rows)
        )
        return extensions, arms

    def joints(self, extensions_m: Array) -> Array:
        """Joint positions (12,), rad and m, at extensions (12,), m; nan where a linkage does not
        reach so far.
        """
        both = zip(extensions_m, self.records, strict=True)
        return np.array([joint_of(float(extension), record) for extension, record in both])

    @cached_property
    def stroke_m(self) -> Array:
        """(12,) extension at each joint's upper limit."""
        return self.rods(self.limits[:, 1])[0]

    def gain_arms(self, joints: Array) -> Array:
        """(12,) the arms by which gains and limits of joints are made from those of cylinders: each
        linkage's where the first leg's joint of that kind stands, so that legs that are built alike
        have the same at any posture (12,).
        """
        first = np.tile(joints[: len(JOINTS)], len(AXES) // len(JOINTS))
        return self.rods(np.clip(first, self.limits[:, 0], self.limits[:, 1]))[1]


def straight(count: int) -> NDArray[Any]:
    """`Linkage` records (count,) of cylinders whose extension is their joint's position."""
    records = Linkage.zeros(count)
    records["slope"] = 1.0
    return records


def _limits_of(axis: Axis) -> tuple[float, float]:
    if isinstance(axis.cylinder, SlideCylinder):
        return 0.0, axis.cylinder.stroke_m
    return axis.limits.ends


def _fill(record: Any, numbers: RotationLinkage | SlideLinkage) -> None:
    """A Linkage from its numbers, but for the length at extension 0."""
    if isinstance(numbers, SlideLinkage):
        record["slope"] = numbers.ratio
        if numbers.across_m > 0.0:
            record["kind"] = INCLINED
            record["along"], record["across"] = numbers.along_m, numbers.across_m
    elif numbers.rack_radius_m > 0.0:
        record["slope"] = numbers.rack_radius_m
    else:
        record["kind"] = LEVER
        record["anchor"], record["lever"] = numbers.body_anchor_m, numbers.lever_m
        record["neutral"] = numbers.angle_neutral_rad


def _check_dead_centre(record: Any, ends: Array, axis: Axis, machine: Machine) -> None:
    """Refuse a linkage whose rod cannot move its joint everywhere."""
    shared = axis.linkage is machine.of_joint(axis.joint, "linkage")
    place = f"{axis.joint}_linkage" if shared else f"axes.{axis.name}.linkage"
    if record["kind"] == LEVER:
        first, last = (float(record["neutral"]) + float(end) for end in ends)
        if not 0.0 < first < last < math.pi:
            raise InputError(
                "reaches a dead centre within the joint's range",
                field=f"{place}.angle_neutral_rad",
                value=float(record["neutral"]),
                allowed="0 < neutral + angle < pi",
            )
    elif record["kind"] == INCLINED and arm_of(0.0, record) < LEAST_ARM * float(record["slope"]):
        least_m = LEAST_ARM * float(record["across"]) / math.sqrt(1.0 - LEAST_ARM**2)
        raise InputError(
            "stands across its slide where that is drawn in",
            field=f"{place}.along_m",
            value=float(record["along"]),
            allowed=f"at least {least_m:.3g} m beside an offset of {float(record['across']):g} m",
        )
