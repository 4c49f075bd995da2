"""Groups of numbers: rigid parts, legs, joints and the linkages that move them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from testbed.machine.groups import Box, Group, Positive, Vector


class RigidPart(Group):
    """Mass and inertia of a link: a homogeneous box with edges along the link's axes about a
    centre.
    """

    mass_kg: Positive
    inertia_box_m: Box
    inertia_centre_m: Vector


class Body(RigidPart):
    """The platform. Its link's origin is the origin of the body frame."""

    belly_height_m: float
    belly_box_m: Box


class PowerUnitBody(RigidPart):
    """Engine, pumps and tank on the platform."""

    position_m: Vector


class DrillBody(RigidPart):
    """Mast with feed sledge, rotary head and hammer; lengths as they are drawn."""

    axis_x_m: float
    axis_y_m: float
    mast_length_m: Positive
    mast_foot_height_m: float
    mast_offset_m: float
    rod_length_m: Positive
    hole_diameter_m: Positive


class RodStoreBody(RigidPart):
    """The carousel of rods, at `position_m` of the body frame; rods in it are payload."""

    position_m: Vector


class TractionBody(RigidPart):
    """One traction device and where its rope pulls, body frame; y of the left one, mirrored for the
    right.
    """

    attachment_x_m: float
    attachment_y_m: float
    attachment_height_m: float


class Leg(Group):
    """One leg. Hips, directions and masses are those of the front left leg, mirrored for the
    others.
    """

    hip_x_m: float
    hip_y_m: float
    hip_z_m: float
    radial_direction_rad: float
    radial_offset_m: float
    foot_height_retracted_m: float
    foot_radius_m: Positive
    foot_plate_radius_m: Positive
    rotation_mass_kg: Positive
    rotation_inertia_box_m: Box
    rotation_inertia_centre_m: Vector
    radial_mass_kg: Positive
    radial_inertia_box_m: Box
    radial_inertia_centre_m: Vector
    vertical_mass_kg: Positive
    vertical_inertia_box_m: Box
    vertical_inertia_centre_m: Vector
    foot_mass_kg: Positive
    foot_inertia_box_m: Box
    foot_inertia_centre_m: Vector

    @property
    def sliding_mass_kg(self) -> float:
        """What the vertical cylinder moves: the inner frame and the foot."""
        return self.vertical_mass_kg + self.foot_mass_kg


class RotationJoint(Group):
    """Range and limits of the rotation joints."""

    lower_rad: float
    upper_rad: float
    effort_n_m: Positive
    velocity_rad_s: Positive

    @property
    def ends(self) -> tuple[float, float]:
        """Lower and upper limit."""
        return self.lower_rad, self.upper_rad


class SlidingJoint(Group):
    """Range and limits of the radial or vertical joints."""

    lower_m: float
    upper_m: float
    effort_n: Positive
    velocity_m_s: Positive

    @property
    def ends(self) -> tuple[float, float]:
        """Lower and upper limit."""
        return self.lower_m, self.upper_m


class Joints(Group):
    """The three joints of a leg."""

    rotation: RotationJoint
    radial: SlidingJoint
    vertical: SlidingJoint


class RotationLinkage(Group):
    """How a cylinder turns its joint: by a lever, or by a rack (robot/linkage.py)."""

    body_anchor_m: Positive
    lever_m: Positive
    angle_neutral_rad: float
    rack_radius_m: Annotated[float, Field(ge=0.0, le=10.0)]


class SlideLinkage(Group):
    """How a cylinder moves its slide: along it, or standing askew beside it
    (robot/linkage.py).
    """

    ratio: Annotated[float, Field(ge=0.1, le=10.0)]
    along_m: Annotated[float, Field(ge=-10.0, le=10.0)]
    across_m: Annotated[float, Field(ge=0.0, le=10.0)]
