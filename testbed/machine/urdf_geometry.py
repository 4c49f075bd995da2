"""What a URDF says of the machine's geometry: the numbers that kinematics, planning and hydraulics
take from it.

A leg of this plan turns about an upright axis at its hip, slides outward along a level line through
that axis, and slides down. Its numbers are the hip, the outward direction at angle 0, how far and
how high the foot is at extension 0, and the ranges of its joints.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.machine.names import JOINTS, LEGS
from testbed.machine.urdf_check import read_urdf

ROUNDING = 1e-9
"""Lengths (m) and angles (rad) that differ by less are the same."""

SOLE_M = 1.0e-5
"""So far may a foot's underside be off its link's origin: at the ground's stiffness 1 kN."""
STRAIGHT_M = 1.0e-6
"""So far may an axis be off the plan of a leg: kinematics then agree with the engine to a
micrometre.
"""


def urdf_numbers(path: str | Path) -> dict[str, Any]:
    """The machine's numbers that a URDF gives: path of each -> value, SI; those of legs and
    cylinders one by one.

    Raises InputError for a URDF that is none, or whose legs are not of this plan, naming link or
    joint.
    """
    return _Geometry(Path(path)).numbers()


class _Geometry:
    """One URDF's links and joints by name."""

    def __init__(self, path: Path) -> None:
        robot = ET.fromstring(read_urdf(path))
        self.path = path
        self.links = {str(link.get("name")): link for link in robot.findall("link")}
        self.joints = {str(joint.get("name")): joint for joint in robot.findall("joint")}
        self.above = {link_of(joint, "child"): joint for joint in self.joints.values()}

    def numbers(self) -> dict[str, Any]:
        """See urdf_numbers."""
        out: dict[str, Any] = {
            "total_mass_kg": sum(self._mass(name) for name in self.links),
            "body.mass_kg": self._mass("body"),
            **self._mounted(),
        }
        for leg in LEGS:
            out |= {f"each_leg.{leg}.{name}": value for name, value in self._leg(leg).items()}
            turn = f"axes.{leg}_rotation.limits"
            out[f"{turn}.lower_rad"], out[f"{turn}.upper_rad"] = self._range(f"{leg}_rotation")
            for slide in (f"{leg}_radial", f"{leg}_vertical"):
                way_m = self._way_m(slide)
                out[f"axes.{slide}.cylinder.stroke_m"] = way_m
                out[f"axes.{slide}.limits.upper_m"] = way_m
        return out

    def _mounted(self) -> dict[str, Any]:
        """What sits on the body: drill, rod store and traction devices, as far as there are any."""
        out: dict[str, Any] = {}
        if "drill_mast" in self.links:
            names = ("axis_x_m", "axis_y_m", "mast_foot_height_m")
            mount = zip(names, self._mount("drill_mast"), strict=True)
            out |= {f"drill_body.{name}": value for name, value in mount}
        if "rod_store" in self.links:
            out["rod_store_body.mass_kg"] = self._mass("rod_store")
            out["rod_store_body.position_m"] = self._mount("rod_store")
        if "traction_left" in self.links:
            names = ("attachment_x_m", "attachment_y_m", "attachment_height_m")
            mount = zip(names, self._mount("traction_left"), strict=True)
            out |= {f"traction_body.{name}": value for name, value in mount}
        return out

    def _leg(self, leg: str) -> dict[str, float]:
        """Hip, direction and foot of a leg as if it were the front left one."""
        turn, slide, lift = (f"{leg}_{joint}" for joint in JOINTS)
        hip, upright = self._axis(turn)
        _, outward = self._axis(slide)
        _, down = self._axis(lift)
        self._needs(turn, upright, (0.0, 0.0, 1.0))
        self._needs(lift, down, (0.0, 0.0, -1.0))
        self._needs(slide, outward, (*_unit(outward[:2]), 0.0))
        self._chain(leg)
        self._check_sole(f"{leg}_foot")
        foot = self._pose(f"{leg}_foot")[1] - hip
        aside = float(outward[0] * foot[1] - outward[1] * foot[0])
        if abs(aside) > STRAIGHT_M:
            raise InputError(
                f"stands {1e3 * aside:.3g} mm beside the line along which its leg extends",
                file=self.path,
                field=f"link {leg}_foot",
                allowed="a foot on the line through the hip's axis along the radial joint",
            )
        front, left = (1.0 if leg[0] == "f" else -1.0), (1.0 if leg[1] == "l" else -1.0)
        return {
            "hip_x_m": front * float(hip[0]),
            "hip_y_m": left * float(hip[1]),
            "hip_z_m": float(hip[2]),
            "radial_direction_rad": math.atan2(left * outward[1], front * outward[0]),
            "radial_offset_m": float(outward @ foot),
            "foot_height_retracted_m": float(hip[2] + foot[2]),
            "rotation_mass_kg": self._mass(link_of(self.joints[turn], "child")),
            "radial_mass_kg": self._mass(link_of(self.joints[slide], "child")),
            "vertical_mass_kg": self._mass(link_of(self.joints[lift], "child")),
            "foot_mass_kg": self._mass(f"{leg}_foot"),
        }

    def _chain(self, leg: str) -> None:
        """A leg hangs on the body joint by joint."""
        parent = "body"
        for joint in JOINTS:
            name = f"{leg}_{joint}"
            found = link_of(self.joints[name], "parent")
            if found != parent:
                raise InputError(
                    "hangs on another link",
                    file=self.path,
                    field=f"joint {name} parent",
                    value=found,
                    allowed=parent,
                )
            parent = link_of(self.joints[name], "child")
        if link_of(self.above[f"{leg}_foot"], "parent") != parent:
            raise InputError(
                "hangs on another link",
                file=self.path,
                field=f"link {leg}_foot",
                value=link_of(self.above[f"{leg}_foot"], "parent"),
                allowed=parent,
            )

    def _check_sole(self, foot: str) -> None:
        """The underside of a foot is at its link's origin: there the legs' kinematics end."""
        turn = self._pose(foot)[0]
        lowest = [_lowest_m(turn, shape) for shape in self.links[foot].findall("collision")]
        if not lowest or abs(min(lowest)) > SOLE_M:
            raise InputError(
                "does not touch the ground where its link begins",
                file=self.path,
                field=f"link {foot} <collision> underside",
                value=f"{min(lowest):.6g} m" if lowest else "none",
                allowed=f"0 m, to {SOLE_M:g}",
            )

    def _needs(self, joint: str, axis: Array, wanted: tuple[float, ...]) -> None:
        if float(np.abs(axis - np.array(wanted)).max()) > STRAIGHT_M:
            kind = (
                "level"
                if joint.endswith("radial")
                else f"({wanted[0]:g} {wanted[1]:g} {wanted[2]:g})"
            )
            raise InputError(
                "points another way than legs of this plan",
                file=self.path,
                field=f"joint {joint} axis in the body frame",
                value=tuple(round(float(word), 6) for word in axis),
                allowed=kind,
            )

    def _way_m(self, name: str) -> float:
        """Way of a slide, from its retracted cylinder on."""
        lower, upper = self._range(name)
        if abs(lower) > ROUNDING:
            raise InputError(
                "is not the retracted cylinder",
                file=self.path,
                field=f"joint {name} lower limit",
                value=lower,
                allowed="0: slides count from where they are drawn in",
            )
        return upper

    def _range(self, joint: str) -> tuple[float, float]:
        limit = self.joints[joint].find("limit")
        assert limit is not None
        return float(limit.get("lower", "0")), float(limit.get("upper", "0"))

    def _axis(self, joint: str) -> tuple[Array, Array]:
        """Origin and direction of a joint's axis at rest, body frame."""
        rotation, origin = self._pose(link_of(self.joints[joint], "child"))
        element = self.joints[joint].find("axis")
        text = "1 0 0" if element is None else element.get("xyz", "1 0 0")
        return origin, rotation @ _unit(np.array([float(word) for word in text.split()]))

    def _mount(self, link: str) -> tuple[float, float, float]:
        x, y, z = self._pose(link)[1].tolist()
        return (x, y, z)

    def _pose(self, link: str) -> tuple[Array, Array]:
        """Rotation and origin of a link in the body frame, all joints at zero."""
        if link == "body":
            return np.eye(3), np.zeros(3)
        joint = self.above[link]
        rotation, origin = self._pose(link_of(joint, "parent"))
        own_rotation, own_origin = origin_of(joint.find("origin"))
        return rotation @ own_rotation, origin + rotation @ own_origin

    def _mass(self, link: str) -> float:
        mass = self.links[link].find("inertial/mass")
        assert mass is not None
        return float(mass.get("value", "0"))


def differing(found: Mapping[str, Any], declared: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers of `found` that are not those declared, but for how a URDF rounds them."""
    return {
        path: value
        for path, value in found.items()
        if not np.allclose(value, declared[path], rtol=1e-9, atol=1e-9)
    }


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


def _lowest_m(turn: Array, collision: ET.Element) -> float:
    """Lowest height of a box, cylinder or sphere, m, in a link's frame that `turn` puts upright."""
    rotation, centre = origin_of(collision.find("origin"))
    down, height = (turn @ rotation)[2], float((turn @ centre)[2])
    geometry = collision.find("geometry")
    shape = None if geometry is None else next(iter(geometry), None)
    if shape is None:
        return height
    radius, length = (float(shape.get(word, "0")) for word in ("radius", "length"))
    if shape.tag == "box":
        edges = np.array([float(word) for word in shape.get("size", "0 0 0").split()])
        return height - float(np.abs(down) @ edges) / 2.0
    if shape.tag == "cylinder":
        return height - abs(float(down[2])) * length / 2.0 - radius * float(np.hypot(*down[:2]))
    return height - radius


def _unit(vector: Array) -> Array:
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
