"""The machine's URDF, generated from its numbers.

`python -m testbed.robot.urdf.generate` rewrites urdf/roboclimber.urdf; `testbed machine FOLDER`
draws one of a folder.

Frames: `body` has its origin at the platform's centre (x up the slope, y left, z away from the
ground). A leg's `rotation` and `radial` links lie at hip height with x outward; `vertical` is on
the foot's axis; `<leg>_foot` has its origin on the plate's underside; `traction_<side>` where the
rope pulls; `drill_mast` on the drill axis at the mast's lower end.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from testbed.formats.files import write_text
from testbed.machine.build import build_machine
from testbed.machine.frame_groups import RotationJoint, SlidingJoint
from testbed.machine.groups import Group
from testbed.machine.model import Machine
from testbed.machine.names import LEGS, SIDES
from testbed.robot.urdf.drawing import COLOURS, Shape, Vector, box_inertia, visuals

HOLDERS = {
    "drill": ("drill_mast", "rod_store"),
    "ropes": tuple(f"traction_{side}" for side in SIDES),
}
"""The links that hold what a machine may be without."""
_ORIGIN: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Link:
    """A rigid part: mass kg, homogeneous box (edges m) about `centre_m`, what of it touches the
    ground.
    """

    name: str
    mass_kg: float
    inertia_box_m: Vector
    centre_m: Vector
    collision: tuple[Shape, ...] = ()


@dataclass(frozen=True)
class Joint:
    """How a link hangs on its parent. Limits: m or rad, N or N m, per s."""

    kind: str
    parent: str
    child: str
    origin_m: Vector
    yaw_rad: float = 0.0
    axis: Vector = _ORIGIN
    lower: float = 0.0
    upper: float = 0.0
    effort: float = 0.0
    velocity: float = 0.0

    @property
    def name(self) -> str:
        """The child's name; fixed joints end in `_mount`."""
        return self.child if self.kind != "fixed" else f"{self.child}_mount"


def hip_m(parameters: Machine, leg: str) -> Vector:
    """Rotation axis of a leg in the body frame, at hip height, m."""
    legs = parameters.each_leg[leg]
    along = legs.hip_x_m if leg[0] == "f" else -legs.hip_x_m
    across = legs.hip_y_m if leg[1] == "l" else -legs.hip_y_m
    return (along, across, legs.hip_z_m)


def radial_direction_rad(parameters: Machine, leg: str) -> float:
    """Yaw of a leg's outward direction in the body frame at joint angle 0, rad."""
    front = parameters.each_leg[leg].radial_direction_rad
    angle = front if leg[0] == "f" else math.pi - front
    return angle if leg[1] == "l" else -angle


def rope_attachment_m(parameters: Machine, side: str) -> Vector:
    """Where a rope pulls on the machine, body frame, m."""
    traction = parameters.traction_body
    across = traction.attachment_y_m if side == "left" else -traction.attachment_y_m
    return (traction.attachment_x_m, across, traction.attachment_height_m)


def drill_mount_m(parameters: Machine) -> Vector:
    """Lower end of the mast on the drill axis, body frame, m."""
    drill = parameters.drill_body
    return (drill.axis_x_m, drill.axis_y_m, drill.mast_foot_height_m)


def structure(parameters: Machine, without: Sequence[str] = ()) -> tuple[list[Link], list[Joint]]:
    """Links and joints of the machine, parents first; `without`: drill, ropes."""
    links, joints = _platform(parameters)
    left_out = {link for what in without for link in HOLDERS[what]}
    links = [link for link in links if link.name not in left_out]
    joints = [joint for joint in joints if joint.child not in left_out]
    for leg in LEGS:
        leg_links, leg_joints = _leg(parameters, leg)
        links += leg_links
        joints += leg_joints
    return links, joints


def _platform(machine: Machine) -> tuple[list[Link], list[Joint]]:
    belly, low = machine.body.belly_box_m, machine.body.belly_height_m
    skid = Shape("box", belly, (0.0, 0.0, low + belly[2] / 2))
    links = [_link("body", machine.body, (skid,)), _link("power_unit", machine.power_unit_body)]
    links += [_link("drill_mast", machine.drill_body), _link("rod_store", machine.rod_store_body)]
    joints = [
        Joint("fixed", "body", "power_unit", machine.power_unit_body.position_m),
        Joint("fixed", "body", "drill_mast", drill_mount_m(machine)),
        Joint("fixed", "body", "rod_store", machine.rod_store_body.position_m),
    ]
    for side in SIDES:
        links.append(_link(f"traction_{side}", machine.traction_body))
        joints.append(Joint("fixed", "body", f"traction_{side}", rope_attachment_m(machine, side)))
    return links, joints


def _link(name: str, group: Group, collision: tuple[Shape, ...] = (), prefix: str = "") -> Link:
    mass, edges, centre = (
        getattr(group, prefix + key) for key in ("mass_kg", "inertia_box_m", "inertia_centre_m")
    )
    return Link(name, mass, edges, centre, collision)


def _leg(machine: Machine, leg: str) -> tuple[list[Link], list[Joint]]:
    legs = machine.each_leg[leg]
    radius = legs.foot_radius_m
    sole = Shape("sphere", (radius,), (0.0, 0.0, radius))
    parts = ("rotation", "radial", "vertical", "foot")
    links = [
        _link(f"{leg}_{part}", legs, (sole,) if part == "foot" else (), f"{part}_")
        for part in parts
    ]
    rotation, radial, vertical, foot = (f"{leg}_{part}" for part in parts)
    turn, slide, lift = (machine.axes[axis].limits for axis in (rotation, radial, vertical))
    assert isinstance(turn, RotationJoint)
    assert isinstance(slide, SlidingJoint) and isinstance(lift, SlidingJoint)
    joints = [
        Joint(
            "revolute",
            "body",
            rotation,
            hip_m(machine, leg),
            radial_direction_rad(machine, leg),
            (0.0, 0.0, 1.0),
            turn.lower_rad,
            turn.upper_rad,
            turn.effort_n_m,
            turn.velocity_rad_s,
        ),
        Joint(
            "prismatic",
            rotation,
            radial,
            (legs.radial_offset_m, 0.0, 0.0),
            0.0,
            (1.0, 0.0, 0.0),
            slide.lower_m,
            slide.upper_m,
            slide.effort_n,
            slide.velocity_m_s,
        ),
        Joint(
            "prismatic",
            radial,
            vertical,
            _ORIGIN,
            0.0,
            (0.0, 0.0, -1.0),
            lift.lower_m,
            lift.upper_m,
            lift.effort_n,
            lift.velocity_m_s,
        ),
        Joint("fixed", vertical, foot, (0.0, 0.0, legs.foot_height_retracted_m - legs.hip_z_m)),
    ]
    return links, joints


def urdf_text(parameters: Machine, name: str = "roboclimber", without: Sequence[str] = ()) -> str:
    """The URDF of the machine that the parameters describe; `without`: drill, ropes."""
    robot = ET.Element("robot", name=name)
    robot.append(
        ET.Comment(" Generated by python -m testbed.robot.urdf.generate from the parameter file. ")
    )
    for colour, rgb in COLOURS.items():
        ET.SubElement(
            ET.SubElement(robot, "material", name=colour), "color", rgba=_numbers((*rgb, 1.0))
        )
    links, joints = structure(parameters, without)
    shapes_of = visuals(parameters)
    for link in links:
        _add_link(robot, link, shapes_of(link.name))
    for joint in joints:
        _add_joint(robot, joint)
    ET.indent(robot, " ")
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def _add_link(robot: ET.Element, link: Link, drawn: list[Shape]) -> None:
    element = ET.SubElement(robot, "link", name=link.name)
    inertial = ET.SubElement(element, "inertial")
    ET.SubElement(inertial, "origin", xyz=_numbers(link.centre_m), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=_numbers((link.mass_kg,)))
    ixx, iyy, izz = (
        _numbers((moment,)) for moment in box_inertia(link.mass_kg, link.inertia_box_m)
    )
    ET.SubElement(inertial, "inertia", ixx=ixx, ixy="0", ixz="0", iyy=iyy, iyz="0", izz=izz)
    for shape in drawn:
        ET.SubElement(_add_shape(element, "visual", shape), "material", name=shape.colour)
    for shape in link.collision:
        _add_shape(element, "collision", shape)


def _add_shape(link: ET.Element, role: str, shape: Shape) -> ET.Element:
    element = ET.SubElement(link, role)
    ET.SubElement(element, "origin", xyz=_numbers(shape.centre), rpy=_numbers(shape.rpy))
    words = {"box": ("size",), "cylinder": ("radius", "length"), "sphere": ("radius",)}[shape.kind]
    values = (shape.size,) if shape.kind == "box" else tuple((side,) for side in shape.size)
    sizes = {word: _numbers(value) for word, value in zip(words, values, strict=True)}
    ET.SubElement(ET.SubElement(element, "geometry"), shape.kind, sizes)
    return element


def _add_joint(robot: ET.Element, joint: Joint) -> None:
    element = ET.SubElement(robot, "joint", name=joint.name, type=joint.kind)
    ET.SubElement(element, "parent", link=joint.parent)
    ET.SubElement(element, "child", link=joint.child)
    ET.SubElement(
        element, "origin", xyz=_numbers(joint.origin_m), rpy=_numbers((0.0, 0.0, joint.yaw_rad))
    )
    if joint.kind == "fixed":
        return
    ET.SubElement(element, "axis", xyz=_numbers(joint.axis))
    limits = {
        word: _numbers((getattr(joint, word),)) for word in ("lower", "upper", "effort", "velocity")
    }
    ET.SubElement(element, "limit", limits)
    ET.SubElement(element, "dynamics", damping="0", friction="0")


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(f"{value + 0.0:.12g}" for value in values)


def main() -> None:
    """Rewrite the URDF of the checkout from the parameter file."""
    target = Path(__file__).resolve().parents[3] / "urdf" / "roboclimber.urdf"
    write_text(target, urdf_text(build_machine()))
    print(f"wrote {target}")


if __name__ == "__main__":
    main()
