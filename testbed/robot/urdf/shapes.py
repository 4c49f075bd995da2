"""Primitive shapes of the drawing and of the contacts, and the inertia of a homogeneous box."""

from __future__ import annotations

import math
from dataclasses import dataclass

Vector = tuple[float, float, float]

COLOURS: dict[str, tuple[float, float, float]] = {
    "yellow": (0.96, 0.70, 0.05),
    "orange": (0.91, 0.36, 0.05),
    "grey": (0.46, 0.48, 0.51),
    "light": (0.62, 0.64, 0.67),
    "dark": (0.17, 0.18, 0.20),
    "chrome": (0.70, 0.72, 0.76),
    "steel": (0.36, 0.39, 0.43),
    "red": (0.72, 0.12, 0.10),
    "glass": (0.25, 0.45, 0.60),
}


@dataclass(frozen=True)
class Shape:
    """One primitive in its link's frame: centre m, roll-pitch-yaw rad; `size` as URDF has it for
    its kind.

    box: edges (x, y, z); cylinder: (radius, length) along its own z; sphere: (radius,). All m.
    """

    kind: str
    size: tuple[float, ...]
    centre: Vector
    rpy: Vector = (0.0, 0.0, 0.0)
    colour: str = "grey"


def box(size: Vector, centre: Vector, colour: str, yaw: float = 0.0) -> Shape:
    """A box with its edges along the link's axes unless turned by `yaw` rad about its upright
    axis.
    """
    return Shape("box", size, centre, (0.0, 0.0, yaw), colour)


def bar(start: Vector, end: Vector, radius: float, colour: str) -> Shape:
    """A round bar from point to point."""
    along = tuple(last - first for first, last in zip(start, end, strict=True))
    length = math.sqrt(sum(part * part for part in along))
    middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2, (start[2] + end[2]) / 2)
    pitch = math.atan2(math.hypot(along[0], along[1]), along[2])
    return Shape(
        "cylinder", (radius, length), middle, (0.0, pitch, math.atan2(along[1], along[0])), colour
    )


def post(radius: float, bottom: float, top: float, x: float, y: float, colour: str) -> Shape:
    """An upright round bar."""
    return Shape(
        "cylinder", (radius, top - bottom), (x, y, (bottom + top) / 2), (0.0, 0.0, 0.0), colour
    )


def box_inertia(mass_kg: float, size_m: Vector) -> Vector:
    """Principal moments (ixx, iyy, izz) kg m2 of a homogeneous box: m/12 (b^2 + c^2) and so on."""
    a, b, c = (side * side for side in size_m)
    return (mass_kg / 12 * (b + c), mass_kg / 12 * (a + c), mass_kg / 12 * (a + b))
