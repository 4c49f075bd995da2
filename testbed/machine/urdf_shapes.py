"""Elements of a URDF as numbers: which link, which frame, how far a shape reaches, which box has a
link's inertia.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from xml.etree import ElementTree as ET

import numpy as np

from testbed.formats.arrays import Array

THIN_M = 1e-6
"""The least edge of a box that stands for an inertia."""


def link_of(joint: ET.Element, end: str) -> str:
    """The link at an `end` of a joint: parent or child."""
    element = joint.find(end)
    return "" if element is None else str(element.get("link"))


def origin_of(origin: ET.Element | None) -> tuple[Array, Array]:
    """Rotation (3, 3) and translation (3,) of a URDF's <origin>; none is the identity."""
    if origin is None:
        return np.eye(3), np.zeros(3)
    xyz = np.array([float(word) for word in origin.get("xyz", "0 0 0").split()])
    rpy = [float(word) for word in origin.get("rpy", "0 0 0").split()]
    return rotation_from_rpy(rpy), xyz


def unit(vector: Array) -> Array:
    """A vector with length 1; zero stays."""
    size = float(np.linalg.norm(vector))
    return vector / size if size > 0.0 else vector


def rotation_from_rpy(rpy: list[float]) -> Array:
    """URDF's convention: R = Rz(yaw) Ry(pitch) Rx(roll), (3, 3)."""
    (cr, cp, cy), (sr, sp, sy) = [[f(word) for word in rpy] for f in (math.cos, math.sin)]
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def second_moments(link: ET.Element) -> Array:
    """Integral of r r^T dm about a link's centre of mass, kg m2, (3, 3), in the link's frame."""
    inertial = link.find("inertial")
    assert inertial is not None
    found = inertial.find("inertia")
    assert found is not None
    xx, xy, xz, yy, yz, zz = (
        float(found.get(word, "0")) for word in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    rotation = origin_of(inertial.find("origin"))[0]
    moments = 0.5 * np.trace(tensor) * np.eye(3) - tensor
    return np.asarray(rotation @ moments @ rotation.T)


def box_like(
    link: ET.Element, mass_kg: float, turn: Array
) -> tuple[tuple[float, float, float], Array]:
    """Edges, m, of the homogeneous box with a link's moments, and its centre (3), m; in the frame
    that `turn` (3, 3) leads to from the link's.
    """
    moments = np.diag(turn @ second_moments(link) @ turn.T)
    x, y, z = np.maximum(np.sqrt(np.maximum(12.0 * moments / mass_kg, 0.0)), THIN_M).tolist()
    return (x, y, z), turn @ origin_of(link.find("inertial/origin"))[1]


def extent(turn: Array, collisions: Sequence[ET.Element]) -> tuple[Array, Array] | None:
    """Least and largest coordinates (3), m, of boxes, cylinders and spheres in the frame that
    `turn` (3, 3) leads to from their link's; None where there are none.
    """
    spans = [_span(turn, collision) for collision in collisions]
    if not spans:
        return None
    return np.min([low for low, _ in spans], axis=0), np.max([high for _, high in spans], axis=0)


def _span(turn: Array, collision: ET.Element) -> tuple[Array, Array]:
    rotation, centre = origin_of(collision.find("origin"))
    axes, middle = turn @ rotation, turn @ centre
    shape = collision.find("geometry/*")
    if shape is None:
        return middle, middle
    radius, length = (float(shape.get(word, "0")) for word in ("radius", "length"))
    if shape.tag == "box":
        edges = np.array([float(word) for word in shape.get("size", "0 0 0").split()])
        half = np.abs(axes) @ edges / 2.0
    elif shape.tag == "cylinder":
        along = axes[:, 2]
        half = np.abs(along) * length / 2.0 + radius * np.sqrt(np.maximum(1.0 - along**2, 0.0))
    else:
        half = np.full(3, radius)
    return middle - half, middle + half


def sphere_radius_m(link: ET.Element) -> float:
    """Radius of the sphere by which a link touches, m; 0 where it has none."""
    sphere = link.find("collision/geometry/sphere")
    return 0.0 if sphere is None else float(sphere.get("radius", "0"))
