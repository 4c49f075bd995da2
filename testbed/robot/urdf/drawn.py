"""A URDF as it is drawn: the shapes of its links and how each link hangs on its parent. Meshes are
left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from testbed.formats.arrays import Array
from testbed.machine.urdf_check import read_urdf
from testbed.machine.urdf_shapes import link_of, origin_of
from testbed.robot.urdf.drawing import COLOURS, Shape

PLAIN = "grey"
"""Colour of what names none of ours."""


@dataclass(frozen=True, eq=False)
class Hanging:
    """How a link hangs on its parent: frame at rest (3, 3; 3, m) and the axis (3,) of its motion,
    in that frame.
    """

    name: str
    kind: str
    parent: str
    child: str
    rotation: Array
    origin_m: Array
    axis: Array

    def pose(self, positions: Array) -> tuple[Array, Array]:
        """Translations (n, 3) m and rotations (n, 3, 3) of the child in its parent at joint
        positions (n), m or rad.
        """
        slid = positions if self.kind == "prismatic" else np.zeros_like(positions)
        turned = positions if self.kind in ("revolute", "continuous") else np.zeros_like(positions)
        places = self.origin_m + slid[:, None] * (self.rotation @ self.axis)
        return places, self.rotation @ _turns(self.axis, turned)


def drawn(urdf: Path) -> tuple[dict[str, list[Shape]], list[Hanging]]:
    """Shapes of each link, and joints with parents first."""
    robot = ET.fromstring(read_urdf(urdf))
    shapes = {str(link.get("name")): _shapes(link) for link in robot.findall("link")}
    waiting = [_hanging(joint) for joint in robot.findall("joint")]
    placed, joints = {"body"}, []
    while waiting:
        ready = [joint for joint in waiting if joint.parent in placed]
        joints += ready
        placed |= {joint.child for joint in ready}
        waiting = [joint for joint in waiting if joint.child not in placed]
    return shapes, joints


def _hanging(joint: ET.Element) -> Hanging:
    rotation, origin = origin_of(joint.find("origin"))
    axis = joint.find("axis")
    along = np.array(
        [float(word) for word in ("1 0 0" if axis is None else axis.get("xyz", "")).split()]
    )
    return Hanging(
        str(joint.get("name")),
        str(joint.get("type")),
        link_of(joint, "parent"),
        link_of(joint, "child"),
        rotation,
        origin,
        along / np.linalg.norm(along),
    )


def _shapes(link: ET.Element) -> list[Shape]:
    found = []
    for visual in link.findall("visual"):
        geometry = visual.find("geometry")
        if geometry is None or len(geometry) == 0 or geometry[0].tag == "mesh":
            continue
        solid, origin, material = geometry[0], visual.find("origin"), visual.find("material")
        words = ("size", "radius", "length")
        size = [float(v) for word in words for v in solid.get(word, "").split()]
        x, y, z = _three(origin, "xyz")
        colour = PLAIN if material is None else str(material.get("name"))
        colour = colour if colour in COLOURS else PLAIN
        found.append(Shape(solid.tag, tuple(size), (x, y, z), _three(origin, "rpy"), colour))
    return found


def _three(origin: ET.Element | None, word: str) -> tuple[float, float, float]:
    text = "0 0 0" if origin is None else origin.get(word, "0 0 0")
    x, y, z = (float(v) for v in text.split())
    return x, y, z


def _turns(axis: Array, angles: Array) -> Array:
    """Rotations (n, 3, 3) by angles (n), rad, about a unit axis (Rodrigues)."""
    x, y, z = axis
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    s, c = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.asarray(np.eye(3) + s * across + (1.0 - c) * (across @ across))
