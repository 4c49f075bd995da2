"""What each link looks like: primitives that draw the machine. What is drawn has no mass and
touches nothing.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from testbed.machine.frame_groups import RotationLinkage
from testbed.machine.model import Axis, Machine
from testbed.machine.names import LEGS

# Primitive shapes of the drawing and of the contacts, and the inertia of a homogeneous box.

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


UPRIGHT_M = 0.94
"""Length of the inner column above the foot's underside, m."""


DRAWN = re.compile(r"(\w*body|legs|each_leg\.\w+|\w+_linkage|axes\.\w+\.linkage)\.\w+")
"""Numbers whose lengths the drawing takes; all others in it are ROBOCLIMBER's."""


def visuals(machine: Machine) -> Callable[[str], list[Shape]]:
    """From the name of a link to its primitives, in its frame (the URDF's). A machine of another
    size is drawn as large as ROBOCLIMBER, then made as large as it is.
    """
    size = machine.scale.length
    large = machine.replaced(
        {
            path: _times(quantity.value, 1.0 / size)
            for path, quantity in machine.leaves()
            if size != 1.0 and quantity.unit == "m" and DRAWN.fullmatch(path)
        }
    )
    return lambda link: [
        replace(shape, size=_times(shape.size, size), centre=_times(shape.centre, size))
        for shape in _drawn(large, link)
    ]


def _times(lengths: Any, factor: float) -> Any:
    return tuple(factor * m for m in lengths) if isinstance(lengths, tuple) else factor * lengths


def _drawn(parameters: Machine, link: str) -> list[Shape]:
    if link.startswith("traction"):
        return _traction(parameters)
    part = link.split("_")[-1] if link[:2] in LEGS else link
    return _PARTS[part](parameters)


def _body(machine: Machine) -> list[Shape]:
    hip_x, hip_y = machine.legs.hip_x_m, machine.legs.hip_y_m
    low = machine.body.belly_height_m
    drawn: list[Shape] = []
    for side in (1.0, -1.0):
        drawn.append(box((1.32, 0.09, 0.20), (0.0, side * 0.43, 0.0), "yellow"))
        drawn.append(box((1.32, 0.16, 0.02), (0.0, side * 0.40, 0.11), "dark"))
        drawn.append(box((1.5, 0.24, 0.04), (0.0, side * 0.23, low + 0.02), "steel"))
        drawn.append(box((0.09, 0.95, 0.20), (side * 0.66, 0.0, 0.0), "yellow"))
        drawn.append(box((0.07, 0.86, 0.16), (0.05 + side * 0.24, 0.0, 0.0), "yellow"))
    drawn.append(box((0.50, 0.78, 0.03), (-0.50, 0.0, 0.10), "grey"))
    drawn.append(box((0.34, 0.78, 0.03), (0.48, 0.0, 0.10), "grey"))
    drawn.append(box((0.26, 0.30, 0.44), (0.10, -0.36, 0.34), "light"))
    drawn.append(box((0.20, 0.01, 0.14), (0.10, -0.515, 0.44), "glass"))
    for leg in LEGS:
        x, y = hip_x if leg[0] == "f" else -hip_x, hip_y if leg[1] == "l" else -hip_y
        drawn += _corner(machine.axes[f"{leg}_rotation"], x, y)
    return drawn


def _corner(axis: Axis, x: float, y: float) -> list[Shape]:
    """Bearing plates of one hip, and the rotation cylinder's barrel along the platform; on a rack
    it lies along the pinion.
    """
    linkage = axis.linkage
    assert isinstance(linkage, RotationLinkage)
    inward = -math.copysign(1.0, x)
    lever = (linkage.rack_radius_m or linkage.lever_m) * math.copysign(1.0, -x)
    beside = lever if linkage.rack_radius_m > 0.0 else 0.0
    anchor = (x + inward * linkage.body_anchor_m, y + beside, 0.17)
    pin = (x, y + lever, 0.17)
    middle = tuple(from_ + 0.62 * (to - from_) for from_, to in zip(anchor, pin, strict=True))
    drawn = [
        box((0.34, 0.26, 0.05), (x + inward * 0.08, y, side * 0.125), "yellow")
        for side in (1.0, -1.0)
    ]
    drawn.append(post(0.05, -0.18, 0.20, x, y, "chrome"))
    drawn.append(bar(anchor, (middle[0], middle[1], middle[2]), 0.042, "dark"))
    drawn.append(bar((middle[0], middle[1], middle[2]), pin, 0.02, "chrome"))
    drawn.append(post(0.03, 0.10, 0.22, anchor[0], anchor[1], "orange"))
    return drawn


def _power_unit(machine: Machine) -> list[Shape]:
    long, wide, tall = machine.power_unit_body.inertia_box_m
    base = -tall / 2
    drawn = [
        box((long, wide, tall * 0.40), (0.0, 0.0, base + tall * 0.20), "dark"),
        box((long * 0.96, wide * 0.94, tall * 0.58), (0.0, 0.0, base + tall * 0.69), "yellow"),
        box((long * 0.80, wide * 0.80, 0.03), (0.0, 0.0, tall / 2 + 0.015), "grey"),
        post(0.035, tall / 2, tall / 2 + 0.28, -long * 0.3, wide * 0.28, "steel"),
        post(0.05, tall / 2, tall / 2 + 0.06, long * 0.25, -wide * 0.25, "red"),
    ]
    for index in range(5):
        drawn.append(
            box((0.015, wide * 0.72, 0.022), (-long / 2, 0.0, 0.0 + 0.045 * index), "dark")
        )
        for side in (1.0, -1.0):
            drawn.append(
                box(
                    (long * 0.6, 0.015, 0.022),
                    (0.0, side * wide * 0.47, 0.0 + 0.045 * index),
                    "dark",
                )
            )
    return drawn


def _drill_mast(machine: Machine) -> list[Shape]:
    drill = machine.drill_body
    length, rails = drill.mast_length_m, drill.mast_offset_m
    half, rear = 0.13, rails - 0.05
    drawn: list[Shape] = []
    for side in (half, -half):
        drawn.append(box((0.05, 0.05, length), (rear, side, length / 2), "orange"))
        drawn.append(box((0.04, 0.04, length), (rails + 0.12, side, length / 2), "orange"))
    bays = 8
    step = length / bays
    for index in range(bays):
        low, high = index * step, (index + 1) * step
        ends = (half, -half) if index % 2 else (-half, half)
        drawn.append(
            bar((rails + 0.12, ends[0], low), (rails + 0.12, ends[1], high), 0.014, "orange")
        )
        for side in (half, -half):
            drawn.append(bar((rear, side, low), (rails + 0.12, side, high), 0.014, "orange"))
        drawn.append(box((0.03, 2 * half, 0.03), (rear, 0.0, high - 0.015), "orange"))
    drawn += _drill_string(machine)
    drawn.append(post(0.045, 0.25, 1.55, rails + 0.035, 0.0, "dark"))
    drawn.append(post(0.025, 1.55, length - 0.1, rails + 0.035, 0.0, "chrome"))
    drawn.append(box((0.34, 0.34, 0.05), (rails - 0.02, 0.0, length), "dark"))
    brace = 0.85
    for side in (1.0, -1.0):
        drawn.append(
            bar((rails + 0.12, side * half, 1.35), (0.62, side * 0.36, 0.20), 0.025, "steel")
        )
        drawn.append(bar((rear, side * half, brace), (-0.22, side * 0.40, 0.20), 0.02, "steel"))
    return drawn


def _drill_string(machine: Machine) -> list[Shape]:
    """Sledge, rotary head, rod and hammer on the drill axis (x = y = 0 of the mast)."""
    drill = machine.drill_body
    rod_top = 0.22 + drill.rod_length_m
    bit = drill.hole_diameter_m / 2
    return [
        box((drill.mast_offset_m - 0.10, 0.18, 0.10), (0.15, 0.0, rod_top + 0.12), "steel"),
        box((0.22, 0.24, 0.30), (0.0, 0.0, rod_top + 0.18), "yellow"),
        post(0.07, rod_top + 0.33, rod_top + 0.50, 0.0, 0.0, "dark"),
        post(0.055, rod_top - 0.06, rod_top + 0.04, 0.0, 0.0, "dark"),
        post(0.030, 0.16, rod_top, 0.0, 0.0, "chrome"),
        post(bit, -0.14, 0.20, 0.0, 0.0, "steel"),
        box((0.26, 0.26, 0.06), (0.06, 0.0, 0.25), "red"),
    ]


def _rod_store(machine: Machine) -> list[Shape]:
    tall = machine.rod_store_body.inertia_box_m[2]
    length = machine.drill_body.rod_length_m
    drawn = [post(0.03, -tall / 2, tall / 2, 0.0, 0.0, "steel")]
    for height in (-0.66, 0.62):
        drawn.append(post(0.17, height, height + 0.03, 0.0, 0.0, "yellow"))
    for index in range(8):
        x, y = (0.13 * turn(2 * math.pi * index / 8) for turn in (math.cos, math.sin))
        drawn.append(post(0.03, -length / 2, length / 2, x, y, "grey" if index % 2 else "light"))
    return drawn


def _traction(machine: Machine) -> list[Shape]:
    """Two gripping jaws on rails behind a sheave; the rope leaves towards +x at the link's
    origin.
    """
    drawn = [
        box((0.56, 0.18, 0.05), (-0.32, 0.0, -0.13), "orange"),
        box((0.06, 0.20, 0.16), (-0.05, 0.0, -0.08), "orange"),
    ]
    for x in (-0.22, -0.46):
        drawn.append(box((0.14, 0.17, 0.16), (x, 0.0, -0.02), "orange"))
        drawn.append(box((0.08, 0.12, 0.05), (x, 0.0, 0.085), "dark"))
    for y in (0.07, -0.07):
        drawn.append(bar((-0.58, y, 0.0), (-0.06, y, 0.0), 0.018, "chrome"))
        drawn.append(bar((-0.04, y * 0.85, -0.10), (-0.04, y * 0.5, -0.10), 0.13, "dark"))
    drawn.append(bar((-0.04, -0.035, -0.10), (-0.04, 0.035, -0.10), 0.10, "chrome"))
    drawn.append(bar((-0.60, 0.0, 0.0), (0.03, 0.0, 0.0), 0.010, "steel"))
    return drawn


def _rotation(machine: Machine) -> list[Shape]:
    return [
        post(0.11, -0.10, 0.10, 0.0, 0.0, "orange"),
        box((0.60, 0.19, 0.18), (0.06, 0.0, 0.0), "grey"),
        box((0.03, 0.22, 0.21), (0.36, 0.0, 0.0), "orange"),
        bar((-0.20, 0.0, 0.125), (0.24, 0.0, 0.125), 0.035, "dark"),
    ]


def _radial(machine: Machine) -> list[Shape]:
    drawn = [
        box((0.62, 0.13, 0.12), (-0.36, 0.0, 0.0), "light"),
        bar((-0.30, 0.0, 0.125), (-0.08, 0.0, 0.125), 0.016, "chrome"),
        box((0.20, 0.20, 0.93), (0.0, 0.0, 0.385), "yellow"),
        box((0.22, 0.22, 0.05), (0.0, 0.0, -0.06), "dark"),
        box((0.22, 0.22, 0.05), (0.0, 0.0, 0.83), "dark"),
        box((0.08, 0.16, 0.34), (-0.12, 0.0, 0.10), "yellow"),
        post(0.045, 0.18, 0.86, 0.155, 0.0, "dark"),
        post(0.055, 0.84, 0.90, 0.155, 0.0, "orange"),
        post(0.022, -0.06, 0.18, 0.155, 0.0, "chrome"),
        box((0.09, 0.10, 0.06), (0.135, 0.0, 0.20), "orange"),
        box((0.09, 0.10, 0.06), (0.135, 0.0, 0.72), "orange"),
    ]
    return drawn


def _vertical(machine: Machine) -> list[Shape]:
    sole = machine.legs.foot_height_retracted_m - machine.legs.hip_z_m
    return [
        box((0.14, 0.14, UPRIGHT_M), (0.0, 0.0, sole + 0.08 + UPRIGHT_M / 2), "light"),
        post(0.020, sole + 0.10, 0.50, 0.155, 0.0, "chrome"),
        box((0.24, 0.10, 0.05), (0.06, 0.0, sole + 0.11), "orange"),
    ]


def _foot(machine: Machine) -> list[Shape]:
    radius = machine.legs.foot_plate_radius_m
    ribs = [
        box((0.24, 0.02, 0.05), (0.0, 0.0, 0.06), "dark", yaw=index * math.pi / 3)
        for index in range(3)
    ]
    return [
        post(radius, 0.0, 0.035, 0.0, 0.0, "dark"),
        post(radius * 0.86, 0.035, 0.045, 0.0, 0.0, "steel"),
        Shape("sphere", (0.055,), (0.0, 0.0, 0.085), colour="chrome"),
        *ribs,
    ]


_PARTS: dict[str, Callable[[Machine], list[Shape]]] = {
    "body": _body,
    "power_unit": _power_unit,
    "drill_mast": _drill_mast,
    "rod_store": _rod_store,
    "rotation": _rotation,
    "radial": _radial,
    "vertical": _vertical,
    "foot": _foot,
}
