"""Reads a URDF and refuses one that cannot be this machine, with one line that says what is wrong
where.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from functools import lru_cache
from pathlib import Path
from xml.parsers import expat

import numpy as np

from testbed.errors import InputError
from testbed.formats.files import read_text
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.machine.urdf_shapes import second_moments

NEEDED_LINKS: tuple[str, ...] = ("body", *(f"{leg}_foot" for leg in LEGS))
OPTIONAL_LINKS: tuple[str, ...] = (
    "drill_mast",
    "rod_store",
    *(f"traction_{side}" for side in SIDES),
)
"""Where the drill, the rods and the ropes act; a machine without them has none of it."""
MOST_BYTES, MOST_ELEMENTS = 2_000_000, 20_000
THIN = 1e-3
"""Share of its moments by which a rounded inertia may be that of no body."""
MOST_M = 10.0
"""No slide is longer, no body's radius of gyration larger: else a URDF is not in metres."""
_NUMBERS = (
    "xyz",
    "rpy",
    "value",
    "ixx",
    "ixy",
    "ixz",
    "iyy",
    "iyz",
    "izz",
    "lower",
    "upper",
    "effort",
    "velocity",
    "size",
    "radius",
    "length",
    "rgba",
)


def read_urdf(path: str | Path) -> str:
    """The text of a URDF that has this machine's links and joints, each link with mass and inertia.

    Raises InputError naming the file, the link or joint and what is wrong.
    """
    text = read_text(path, MOST_BYTES)
    _links_of(text, str(path))
    return text


def lacking(path: Path) -> set[str]:
    """The links of OPTIONAL_LINKS that a URDF does not have. Raises InputError as read_urdf."""
    return set(OPTIONAL_LINKS) - _links_of(read_text(path, MOST_BYTES), str(path))


@lru_cache(maxsize=16)
def _links_of(text: str, path: str) -> frozenset[str]:
    """Names of a sound URDF's links; what was found sound once is not looked through again."""
    try:
        _check_markup(text, path)
        robot = ET.fromstring(text)
    except (ET.ParseError, expat.ExpatError) as error:
        raise InputError(f"is not XML: {error}", file=path) from error
    if robot.tag != "robot":
        raise InputError(f"its root element is <{robot.tag}>", file=path, allowed="<robot>")
    _check_references(robot, path)
    _check_numbers(robot, path)
    links = _named(robot, "link", path)
    joints = _named(robot, "joint", path)
    for name, link in links.items():
        _check_inertial(name, link, path)
    _check_tree(links, joints, path)
    for name in NEEDED_LINKS:
        if name not in links:
            raise InputError("is missing", file=path, field=f"link {name}")
    for name in AXES:
        _check_axis(name, joints, path)
    _check_passive(joints, path)
    if len({f"traction_{side}" in links for side in SIDES}) > 1:
        raise InputError(
            "has one traction device without the other",
            file=path,
            field=f"link traction_{SIDES[1]}",
            allowed="both, or none",
        )
    return frozenset(links)


def _check_markup(text: str, path: str | Path) -> None:
    """Refuse a document type, whose entities can stand for gigabytes or for other files, and
    endless elements.
    """
    found = 0

    def doctype(*_: object) -> None:
        raise InputError("has a document type or entities", file=path, allowed="elements alone")

    def element(*_: object) -> None:
        nonlocal found
        found += 1
        if found > MOST_ELEMENTS:
            raise InputError(f"has more than {MOST_ELEMENTS} elements", file=path)

    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler, parser.StartElementHandler = doctype, element
    parser.Parse(text, True)


def _check_references(robot: ET.Element, path: str | Path) -> None:
    """Refuse what refers to other files: meshes, textures."""
    for element in robot.iter():
        if element.get("filename") is not None or element.tag == "mesh":
            raise InputError(
                "refers to another file",
                file=path,
                field=f"<{element.tag}>",
                value=element.get("filename"),
                allowed="<box>, <cylinder>, <sphere>",
            )


def _named(robot: ET.Element, tag: str, path: str | Path) -> dict[str, ET.Element]:
    found: dict[str, ET.Element] = {}
    for element in robot.findall(tag):
        name = element.get("name")
        if not name:
            raise InputError(f"a <{tag}> has no name", file=path)
        if name in found:
            raise InputError("appears twice", file=path, field=f"{tag} {name}")
        found[name] = element
    return found


def _check_numbers(robot: ET.Element, path: str | Path) -> None:
    for owner in robot:
        for element in owner.iter():
            for word in _NUMBERS:
                raw = element.get(word)
                if raw is not None and not _all_finite(raw):
                    where = f"{owner.tag} {owner.get('name')} <{element.tag}> {word}"
                    raise InputError("is not finite numbers", file=path, field=where, value=raw)


def _all_finite(raw: str) -> bool:
    try:
        return bool(raw.split()) and all(math.isfinite(float(part)) for part in raw.split())
    except ValueError:
        return False


def _check_inertial(name: str, link: ET.Element, path: str | Path) -> None:
    mass = link.find("inertial/mass")
    inertia = link.find("inertial/inertia")
    if mass is None or inertia is None:
        allowed = "an <inertial> in every link"
        raise InputError("has no mass or inertia", file=path, field=f"link {name}", allowed=allowed)
    value = float(mass.get("value", "nan"))
    if not value > 0.0:
        raise InputError(
            "must be positive", file=path, field=f"link {name} mass", value=value, allowed="> 0 kg"
        )
    ixx, ixy, ixz, iyy, iyz, izz = (
        float(inertia.get(moment, "nan")) for moment in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    minors = (
        ixx,
        ixx * iyy - ixy**2,
        ixx * (iyy * izz - iyz**2) - ixy * (ixy * izz - iyz * ixz) + ixz * (ixy * iyz - iyy * ixz),
    )
    if not all(minor > 0.0 for minor in minors):
        raise InputError("is not positive definite", file=path, field=f"link {name} inertia")
    most = value * MOST_M**2
    if ixx + iyy + izz > 2.0 * most:
        raise InputError(
            f"is out of range for {value:g} kg: a URDF is in kg m2",
            file=path,
            field=f"link {name} inertia ixx + iyy + izz",
            value=ixx + iyy + izz,
            allowed=f"at most {2.0 * most:g}",
        )
    if np.linalg.eigvalsh(second_moments(link))[0] < -THIN * (ixx + iyy + izz):
        raise InputError(
            "is that of no body: the largest moment exceeds the sum of the others",
            file=path,
            field=f"link {name} inertia",
            allowed="ixx <= iyy + izz, and so on",
        )


def _check_tree(
    links: dict[str, ET.Element], joints: dict[str, ET.Element], path: str | Path
) -> None:
    parents: dict[str, str] = {}
    for name, joint in joints.items():
        ends = []
        for end in ("parent", "child"):
            element = joint.find(end)
            link = "" if element is None else element.get("link", "")
            if link not in links:
                raise InputError(
                    f"its {end} is no link", file=path, field=f"joint {name}", value=link
                )
            ends.append(link)
        if ends[1] in parents:
            raise InputError("hangs on two joints", file=path, field=f"link {ends[1]}")
        parents[ends[1]] = ends[0]
    for name in links:
        node, steps = name, 0
        while node in parents and steps <= len(links):
            node, steps = parents[node], steps + 1
        if node != "body":
            raise InputError("is not connected to the body", file=path, field=f"link {name}")


def _check_axis(name: str, joints: dict[str, ET.Element], path: str | Path) -> None:
    kind = "revolute" if name.endswith("rotation") else "prismatic"
    if name not in joints:
        raise InputError("is missing", file=path, field=f"joint {name}")
    found = joints[name].get("type")
    if found != kind:
        raise InputError(
            "has the wrong type", file=path, field=f"joint {name}", value=found, allowed=kind
        )
    limit = joints[name].find("limit")
    if limit is None or float(limit.get("lower", "0")) >= float(limit.get("upper", "0")):
        raise InputError("needs limits with lower < upper", file=path, field=f"joint {name}")
    for word in ("effort", "velocity"):
        if limit.get(word) is None:
            raise InputError(f"its limit has no {word}", file=path, field=f"joint {name}")
    most, unit = (math.pi, "rad") if kind == "revolute" else (MOST_M, "m")
    for end in ("lower", "upper"):
        value = float(limit.get(end, "0"))
        if abs(value) > most:
            raise InputError(
                f"is out of range: a URDF is in {unit}",
                file=path,
                field=f"joint {name} {end} limit",
                value=value,
                allowed=f"-{most:.4g} to {most:.4g} {unit}",
            )


def _check_passive(joints: dict[str, ET.Element], path: str | Path) -> None:
    """Refuse what would be overruled: cylinders alone move the joints, and their seals rub."""
    for name, joint in joints.items():
        if joint.get("type") != "fixed" and name not in AXES:
            raise InputError(
                "would hang loose",
                file=path,
                field=f"joint {name}",
                allowed="fixed, or one of a leg's",
            )
        if joint.find("mimic") is not None:
            raise InputError("would have no effect", file=path, field=f"joint {name} <mimic>")
        dynamics = joint.find("dynamics")
        for word in ("damping", "friction"):
            value = 0.0 if dynamics is None else float(dynamics.get(word, "0"))
            if value != 0.0:
                raise InputError(
                    "would have no effect: its cylinder's friction is among the machine's numbers",
                    file=path,
                    field=f"joint {name} {word}",
                    value=value,
                    allowed="0",
                )
