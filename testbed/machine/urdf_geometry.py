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
from testbed.machine.urdf_shapes import (
    box_like,
    extent,
    link_of,
    origin_of,
    sphere_radius_m,
    unit,
)

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
            **self._part("body", "body."),
            **self._belly(),
            **self._mounted(),
        }
        for leg in LEGS:
            out |= {f"each_leg.{leg}.{name}": value for name, value in self._leg(leg).items()}
            turn = f"{leg}_rotation"
            lower, upper = self._range(turn)
            limits = {"lower_rad": lower, "upper_rad": upper, **self._most(turn, "n_m", "rad_s")}
            out |= {f"axes.{turn}.limits.{name}": value for name, value in limits.items()}
            for slide in (f"{leg}_radial", f"{leg}_vertical"):
                way_m = self._way_m(slide)
                limits = {"upper_m": way_m, **self._most(slide, "n", "m_s")}
                out[f"axes.{slide}.cylinder.stroke_m"] = way_m
                out |= {f"axes.{slide}.limits.{name}": value for name, value in limits.items()}
        return out

    def _belly(self) -> dict[str, Any]:
        """What of the platform touches the ground: the box about its shapes."""
        found = extent(np.eye(3), self.links["body"].findall("collision"))
        if found is None:
            return {}
        lowest, highest = found
        edges = tuple((highest - lowest).tolist())
        return {"body.belly_height_m": float(lowest[2]), "body.belly_box_m": edges}

    def _mounted(self) -> dict[str, Any]:
        """What sits on the body: drill, rod store and traction devices, as far as there are any."""
        out: dict[str, Any] = {}
        if "drill_mast" in self.links:
            names = ("axis_x_m", "axis_y_m", "mast_foot_height_m")
            mount = zip(names, self._mount("drill_mast"), strict=True)
            out |= {f"drill_body.{name}": value for name, value in mount}
            out |= self._part("drill_mast", "drill_body.")
        if "power_unit" in self.links:
            out |= self._part("power_unit", "power_unit_body.")
            out["power_unit_body.position_m"] = self._mount("power_unit")
        if "rod_store" in self.links:
            out |= self._part("rod_store", "rod_store_body.")
            out["rod_store_body.position_m"] = self._mount("rod_store")
        if "traction_left" in self.links:
            names = ("attachment_x_m", "attachment_y_m", "attachment_height_m")
            mount = zip(names, self._mount("traction_left"), strict=True)
            out |= {f"traction_body.{name}": value for name, value in mount}
            out |= self._part("traction_left", "traction_body.")
        return out

    def _part(
        self, link: str, prefix: str, axes: Array | None = None, origin_m: Array | None = None
    ) -> dict[str, Any]:
        """Mass, centre and the homogeneous box of a link's inertia, along `axes` (3, 3) of the body
        frame and from a point of it; else the body's axes and the link's own origin.
        """
        turn, origin = self._pose(link)
        axes = np.eye(3) if axes is None else axes
        mass_kg = self._mass(link)
        box_m, centre_m = box_like(self.links[link], mass_kg, axes.T @ turn)
        off = np.zeros(3) if origin_m is None else axes.T @ (origin - origin_m)
        return {
            f"{prefix}mass_kg": mass_kg,
            f"{prefix}inertia_box_m": box_m,
            f"{prefix}inertia_centre_m": tuple((centre_m + off).tolist()),
        }

    def _leg(self, leg: str) -> dict[str, Any]:
        """Hip, direction and foot of a leg as if it were the front left one."""
        turn, slide, lift = (f"{leg}_{joint}" for joint in JOINTS)
        hip, upright = self._axis(turn)
        _, outward = self._axis(slide)
        _, down = self._axis(lift)
        self._needs(turn, upright, (0.0, 0.0, 1.0))
        self._needs(lift, down, (0.0, 0.0, -1.0))
        self._needs(slide, outward, (*unit(outward[:2]), 0.0))
        self._chain(leg)
        self._check_sole(f"{leg}_foot", link_of(self.joints[lift], "child"))
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
        axes = np.column_stack([outward, np.cross(upright, outward), upright])
        over = hip + float(outward @ foot) * outward  # on the foot's axis, at hip height
        links = {
            "rotation": (link_of(self.joints[turn], "child"), hip),
            "radial": (link_of(self.joints[slide], "child"), over),
            "vertical": (link_of(self.joints[lift], "child"), over),
            "foot": (f"{leg}_foot", hip + foot),
        }
        parts: dict[str, Any] = {}
        for part, (link, origin) in links.items():
            parts |= self._part(link, f"{part}_", axes, origin)
        radius_m = sphere_radius_m(self.links[f"{leg}_foot"])
        return {
            "hip_x_m": front * float(hip[0]),
            "hip_y_m": left * float(hip[1]),
            "hip_z_m": float(hip[2]),
            "radial_direction_rad": math.atan2(left * outward[1], front * outward[0]),
            "radial_offset_m": float(outward @ foot),
            "foot_height_retracted_m": float(hip[2] + foot[2]),
            **({"foot_radius_m": radius_m} if radius_m > 0.0 else {}),
            **parts,
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

    def _check_sole(self, foot: str, column: str) -> None:
        """The underside of a foot is at its link's origin: there the legs' kinematics end. Nothing
        else of what goes down with it, all that is fixed to the `column`, is lower.
        """
        sole_m = float(self._pose(foot)[1][2])
        for link in self.links:
            if not self._is_fixed_to(link, column):
                continue
            turn, origin = self._pose(link)
            found = extent(turn, self.links[link].findall("collision"))
            lowest_m = math.inf if found is None else float(found[0][2] + origin[2]) - sole_m
            if lowest_m < -SOLE_M or (link == foot and lowest_m > SOLE_M):
                raise InputError(
                    "does not end at the underside of the foot, where its link begins",
                    file=self.path,
                    field=f"link {link} <collision> underside",
                    value="none" if found is None else f"{lowest_m:.6g} m",
                    allowed=f"0 m, to {SOLE_M:g}" if link == foot else "above it",
                )

    def _is_fixed_to(self, link: str, column: str) -> bool:
        """Whether a link is another one, or hangs on it by fixed joints alone."""
        while link != column and link in self.above and self.above[link].get("type") == "fixed":
            link = link_of(self.above[link], "parent")
        return link == column

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

    def _most(self, joint: str, force: str, speed: str) -> dict[str, float]:
        """Effort and velocity of a joint, named with their units."""
        limit = self.joints[joint].find("limit")
        assert limit is not None
        names = (("effort", force), ("velocity", speed))
        return {f"{word}_{unit}": float(limit.get(word, "0")) for word, unit in names}

    def _range(self, joint: str) -> tuple[float, float]:
        limit = self.joints[joint].find("limit")
        assert limit is not None
        return float(limit.get("lower", "0")), float(limit.get("upper", "0"))

    def _axis(self, joint: str) -> tuple[Array, Array]:
        """Origin and direction of a joint's axis at rest, body frame."""
        rotation, origin = self._pose(link_of(self.joints[joint], "child"))
        element = self.joints[joint].find("axis")
        text = "1 0 0" if element is None else element.get("xyz", "1 0 0")
        return origin, rotation @ unit(np.array([float(word) for word in text.split()]))

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
