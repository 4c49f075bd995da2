"""Fixed links welded into what carries them: the same machine with fewer bodies for an engine to
step.

Masses, centres and full inertias are added exactly; the result is written in principal axes, so
that nothing is lost to an engine that knows diagonal inertias only. Links named in `keep` stay
apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from xml.etree import ElementTree as ET

import numpy as np

from testbed.formats.arrays import Array
from testbed.machine.urdf_shapes import origin_of

UPRIGHT = 1e-9
"""Cosine of the pitch below which roll and yaw are one angle."""


@lru_cache(maxsize=4)
def merged(text: str, keep: tuple[str, ...] = ()) -> str:
    """URDF text in which every fixed joint is welded, save for those to links in `keep`."""
    robot = ET.fromstring(text)
    while True:
        joint = next(
            (j for j in robot.iter("joint") if j.get("type") == "fixed" and _child(j) not in keep),
            None,
        )
        if joint is None:
            return ET.tostring(robot, encoding="unicode")
        _weld(robot, joint)


def ballasted(
    text: str,
    masses: Sequence[tuple[float, Sequence[float]]],
    shift_m: Sequence[float] = (0.0, 0.0, 0.0),
) -> str:
    """URDF text whose link `body` carries point masses, kg, at points (3) of its frame, m, besides
    what it had.

    `shift_m` (3): by how much the body's own centre of mass lies elsewhere.
    """
    robot = ET.fromstring(text)
    body = next(link for link in robot.findall("link") if link.get("name") == "body")
    mass, centre, tensor = _mass(body, np.eye(3), np.zeros(3))
    points = [(kg, np.array(point, dtype=np.float64), np.zeros((3, 3))) for kg, point in masses]
    _set_inertial(body, [(mass, centre + np.asarray(shift_m), tensor), *points])
    return ET.tostring(robot, encoding="unicode")


def rehung(text: str, shifts_m: Mapping[str, Sequence[float]]) -> str:
    """URDF text whose legs hang elsewhere: leg -> shift (3) of its rotation joint, body frame,
    m.
    """
    robot = ET.fromstring(text)
    for joint in robot.findall("joint"):
        leg, _, kind = str(joint.get("name")).partition("_")
        if kind == "rotation" and leg in shifts_m:
            rotation, place = origin_of(joint.find("origin"))
            _set_frame(joint, rotation, place + np.asarray(shifts_m[leg]))
    return ET.tostring(robot, encoding="unicode")


def _weld(robot: ET.Element, joint: ET.Element) -> None:
    links = {link.get("name"): link for link in robot.findall("link")}
    parent, child = links[_end(joint, "parent")], links[_child(joint)]
    rotation, shift = origin_of(joint.find("origin"))
    bodies = [_mass(parent, np.eye(3), np.zeros(3)), _mass(child, rotation, shift)]
    for part in (*child.findall("visual"), *child.findall("collision")):
        own_rotation, own_shift = origin_of(part.find("origin"))
        _set_frame(part, rotation @ own_rotation, shift + rotation @ own_shift)
        parent.append(part)
    _set_inertial(parent, bodies)
    for other in robot.findall("joint"):
        if _end(other, "parent") == child.get("name"):
            own_rotation, own_shift = origin_of(other.find("origin"))
            _set_frame(other, rotation @ own_rotation, shift + rotation @ own_shift)
            other.find("parent").set("link", str(parent.get("name")))  # type: ignore[union-attr]
    robot.remove(joint)
    robot.remove(child)


def _mass(link: ET.Element, rotation: Array, shift: Array) -> tuple[float, Array, Array]:
    """Mass, centre (3) and inertia about it (3, 3) of a link, in its parent's frame."""
    inertial = link.find("inertial")
    if inertial is None:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    mass = float(inertial.find("mass").get("value"))  # type: ignore[union-attr, arg-type]
    moments = {name: float(value) for name, value in inertial.find("inertia").attrib.items()}  # type: ignore[union-attr]
    tensor = np.array(
        [
            [moments["ixx"], moments["ixy"], moments["ixz"]],
            [moments["ixy"], moments["iyy"], moments["iyz"]],
            [moments["ixz"], moments["iyz"], moments["izz"]],
        ]
    )
    own_rotation, own_shift = origin_of(inertial.find("origin"))
    turn = rotation @ own_rotation
    return mass, shift + rotation @ own_shift, turn @ tensor @ turn.T


def _set_inertial(link: ET.Element, bodies: list[tuple[float, Array, Array]]) -> None:
    mass = sum(mass_ for mass_, _, _ in bodies)
    centre = sum((mass_ * at for mass_, at, _ in bodies), np.zeros(3)) / mass
    tensor = np.zeros((3, 3))
    for m, c, own in bodies:
        arm = c - centre
        tensor += own + m * (float(arm @ arm) * np.eye(3) - np.outer(arm, arm))
    turn, diagonal = np.eye(3), np.diag(tensor)
    if np.abs(tensor - np.diag(diagonal)).max() > 1e-9 * np.abs(tensor).max():
        diagonal, turn = np.linalg.eigh(tensor)
        turn, diagonal = _nearest_axes(turn, diagonal)
    old = link.find("inertial")
    if old is not None:
        link.remove(old)
    inertial = ET.SubElement(link, "inertial")
    _set_frame(inertial, turn, centre)
    ET.SubElement(inertial, "mass", value=repr(float(mass)))
    zero = {"ixy": "0", "ixz": "0", "iyz": "0"}
    moments = {
        name: repr(float(moment))
        for name, moment in zip(("ixx", "iyy", "izz"), diagonal, strict=True)
    }
    ET.SubElement(inertial, "inertia", zero | moments)


def _nearest_axes(turn: Array, diagonal: Array) -> tuple[Array, Array]:
    """The principal axes in the order and sense that turns least."""
    order = [int(np.argmax(np.abs(turn[index]))) for index in range(3)]
    if sorted(order) != [0, 1, 2]:
        order = [0, 1, 2]
    turn, diagonal = turn[:, order], diagonal[order]
    turn = turn * np.where(np.diag(turn) < 0, -1.0, 1.0)
    if np.linalg.det(turn) < 0:
        turn[:, 2] = -turn[:, 2]
    return turn, diagonal


def _set_frame(element: ET.Element, rotation: Array, shift: Array) -> None:
    old = element.find("origin")
    if old is not None:
        element.remove(old)
    rpy = rpy_from_rotation(rotation)
    xyz = " ".join(map(repr, shift.tolist()))
    element.insert(0, ET.Element("origin", xyz=xyz, rpy=" ".join(map(repr, rpy))))


def _end(joint: ET.Element, end: str) -> str:
    return str(joint.find(end).get("link"))  # type: ignore[union-attr]


def _child(joint: ET.Element) -> str:
    return _end(joint, "child")


def rpy_from_rotation(rotation: Array) -> list[float]:
    """The inverse, rad; at pitch +-90 degrees, where roll and yaw are one angle, roll is 0."""
    across = math.hypot(rotation[0, 0], rotation[1, 0])
    pitch = math.atan2(-rotation[2, 0], across)
    if across < UPRIGHT:
        return [0.0, pitch, math.atan2(-rotation[0, 1], rotation[1, 1])]
    return [
        math.atan2(rotation[2, 1], rotation[2, 2]),
        pitch,
        math.atan2(rotation[1, 0], rotation[0, 0]),
    ]
