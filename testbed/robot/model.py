"""The rigid-body model we believe: masses, gravity and Jacobians of the machine, by Pinocchio, read
once from the URDF.

Conventions: joint positions are (12,) in AXES order (rad for rotation, m for radial and vertical).
Everything is expressed in the body frame (origin = origin of the link `body`); the world enters
through gravity in the body frame alone. Generalised vectors are (18,): force or velocity of the
body's origin (3), moment or angular velocity about it (3), joints (12). Generalised forces are
those that hold or drive the machine (joint torque positive along the joint's axis).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from testbed.compiled import njit
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.machine.names import AXES, GRAVITY_M_S2, LEGS, SIDES
from testbed.machine.urdf_check import read_urdf
from testbed.machine.urdf_shapes import sphere_radius_m
from testbed.robot.loads.foot_forces import LegNumbers


@dataclass(frozen=True)
class Payload:
    """A point mass carried by the platform (rods in store or in hand), at a point of the body
    frame, m.
    """

    mass_kg: float
    point_in_body_m: tuple[float, float, float]


def attitude_gravity(roll_rad: float, pitch_rad: float) -> Array:
    """Gravity in the body frame, m/s2, (3,), from roll and pitch (rotations z, y, x in this order;
    any yaw).

    A body parallel to a slope that rises towards +x has pitch = -slope.
    """
    level = np.cos(pitch_rad)
    return GRAVITY_M_S2 * np.array(
        [np.sin(pitch_rad), -np.sin(roll_rad) * level, -np.cos(roll_rad) * level]
    )


class RobotModel:
    """Masses, gravity, inertia and foot kinematics of one URDF. Not for use by two threads at once
    (one workspace).
    """

    def __init__(
        self, path: str | Path, payload: Payload | None = None, rope_height_m: float | None = None
    ) -> None:
        """Read a URDF, with a payload fixed to the platform if given. Raises InputError if the URDF
        is broken.

        `rope_height_m`: height of the ropes' attachments in the body frame instead of the URDF's.
        """
        self.path, self.payload = Path(path), payload
        text = read_urdf(path)
        try:
            self._model: Any = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
        except (ValueError, RuntimeError) as error:
            raise InputError(f"is refused as a URDF: {error}", file=path) from error
        if payload is not None:
            self._add(payload)
        self._data: Any = self._model.createData()
        joints = [self._model.joints[self._model.getJointId(name)] for name in AXES]
        self._q_index = np.array([joint.idx_q for joint in joints])
        self._v_index = np.array([joint.idx_v for joint in joints])
        self._order = np.concatenate([np.arange(6), self._v_index])
        self._feet = [self._model.getFrameId(f"{leg}_foot") for leg in LEGS]
        self._q: Array = np.asarray(pin.neutral(self._model))
        self.limits: Array = np.column_stack(
            [
                self._model.lowerPositionLimit[self._q_index],
                self._model.upperPositionLimit[self._q_index],
            ]
        )
        """Joint limits (12, 2), rad and m."""
        self.foot_radii_m: Array = _foot_radii(text)
        """Radius of the sphere by which each foot touches, (4,); its lowest point is the foot
        frame's origin.
        """
        self.total_mass_kg = float(pin.computeTotalMass(self._model))
        pin.framesForwardKinematics(self._model, self._data, self._q)
        self.rope_attachments_m: Array = np.array(
            [self._origin(f"traction_{side}") for side in SIDES]
        )
        """Where the ropes pull, body frame, (2, 3), left then right."""
        if rope_height_m is not None:
            self.rope_attachments_m[:, 2] = rope_height_m
        self.drill_mount_m: Array = self._origin("drill_mast")
        """Lower end of the mast on the drill axis (along body -z), body frame, (3,)."""
        self.rod_store_m: Array = self._origin("rod_store")
        """Where the rods in store weigh, body frame, (3,)."""

    @property
    def carried_kg(self) -> float:
        """Mass of the payload."""
        return 0.0 if self.payload is None else self.payload.mass_kg

    def centre_of_mass_m(self, positions: ArrayLike) -> Array:
        """Centre of mass in the body frame, (3,), m."""
        return np.array(pin.centerOfMass(self._model, self._data, self._full(positions), False))

    def link_centres_m(self, positions: ArrayLike) -> Array:
        """Centres of mass of what each axis moves directly, body frame, (12, 3), AXES order, m."""
        pin.forwardKinematics(self._model, self._data, self._full(positions))
        joints = [self._model.getJointId(name) for name in AXES]
        return np.array(
            [self._data.oMi[joint].act(self._model.inertias[joint].lever) for joint in joints]
        )

    def mass_matrix(self, positions: ArrayLike) -> Array:
        """Joint-space inertia (18, 18), body velocity in the body frame at the body's origin."""
        upper = np.triu(pin.crba(self._model, self._data, self._full(positions)))
        full = upper + np.triu(upper, 1).T
        return np.asarray(full[np.ix_(self._order, self._order)])

    def gravity_forces(self, positions: ArrayLike, gravity_in_body: ArrayLike) -> Array:
        """Generalised forces (18,) that hold the machine against gravity: N, N m; joints N m or N.

        The first six are the support's force and moment about the body's origin, in the body frame.
        """
        self._model.gravity.linear = np.asarray(gravity_in_body, dtype=float)
        held = pin.computeGeneralizedGravity(self._model, self._data, self._full(positions))
        return np.asarray(held[self._order])

    def inverse_dynamics(
        self,
        positions: ArrayLike,
        velocities: ArrayLike,
        accelerations: ArrayLike,
        gravity_in_body: ArrayLike,
    ) -> Array:
        """Generalised forces (18,) that produce accelerations (18,) at velocities (18,), gravity
        included.

        Body velocity and acceleration are those of the body's origin, resolved in the body frame
        (the acceleration is the derivative of these components, so a turning body adds omega x v by
        itself).
        """
        self._model.gravity.linear = np.asarray(gravity_in_body, dtype=float)
        speed, change = np.empty(18), np.empty(18)
        speed[self._order], change[self._order] = velocities, accelerations
        force = pin.rnea(self._model, self._data, self._full(positions), speed, change)
        return np.asarray(force[self._order])

    def asked_by_masses(
        self, positions: ArrayLike, gravity_in_body: ArrayLike
    ) -> tuple[Array, Array]:
        """Generalised forces that masses ask for at rest: (18, 12) by one more kilogram at the
        centre of what each axis moves, (18, 4) by one kilogram at the body's origin and by first
        moments of the body of 1 kg m along x, y, z.
        """
        model, data = self._model, self._data
        model.gravity.linear = np.asarray(gravity_in_body, dtype=float)
        still = np.zeros(model.nv)
        by = pin.computeJointTorqueRegressor(model, data, self._full(positions), still, still)
        by = np.asarray(by)[self._order]
        joints = [model.getJointId(name) for name in AXES]
        links = [
            by[:, 10 * (joint - 1)]
            + by[:, 10 * joint - 9 : 10 * joint - 6] @ model.inertias[joint].lever
            for joint in joints
        ]
        return np.column_stack(links), by[:, :4].copy()

    def asked_by_lift(self, positions: ArrayLike) -> Array:
        """Generalised forces (18, 3) that the machine asks for by 1 m/s2 of specific force along x,
        y, z of the body.
        """
        return np.column_stack([self.gravity_forces(positions, -way) for way in np.eye(3)])

    def feet(self, positions: ArrayLike) -> tuple[Array, Array]:
        """Undersides of the feet in the body frame (4, 3), m, and their Jacobians (4, 3, 12) with
        the body at rest.
        """
        pin.computeJointJacobians(self._model, self._data, self._full(positions))
        pin.updateFramePlacements(self._model, self._data)
        points = np.array([self._data.oMf[frame].translation for frame in self._feet])
        jacobians = np.array(
            [
                pin.getFrameJacobian(self._model, self._data, frame, pin.LOCAL_WORLD_ALIGNED)
                for frame in self._feet
            ]
        )
        return points, jacobians[:, :3, self._v_index]

    def leg_numbers(self) -> NDArray[Any]:
        """Masses, centres and axes of the legs (4,) as LegNumbers of foot_forces.py, from the
        body's origin.
        """
        model, data = self._model, self._data
        zero = np.asarray(pin.neutral(model))
        pin.computeJointJacobians(model, data, zero)
        pin.updateFramePlacements(model, data)
        legs = LegNumbers.zeros(len(LEGS))
        for index, leg in enumerate(legs):
            names = AXES[3 * index : 3 * index + 3]
            joints = [model.getJointId(name) for name in names]
            first = data.oMi[joints[0]]
            slide = pin.getJointJacobian(model, data, joints[1], pin.LOCAL_WORLD_ALIGNED)
            leg["hip"] = first.translation
            leg["yaw"] = np.arctan2(first.rotation[1, 0], first.rotation[0, 0])
            leg["radial"] = slide[:3, self._v_index[3 * index + 1]]
            for place, joint in enumerate(joints):
                link, placed = model.inertias[joint], data.oMi[joint]
                leg["links"]["centre"][place] = placed.act(link.lever) - first.translation
                leg["links"]["mass"][place] = link.mass
                leg["links"]["inertia"][place] = np.diag(link.inertia)
            leg["foot_radius"] = self.foot_radii_m[index]
            leg["foot"] = (data.oMf[self._feet[index]].translation - first.translation)[:2]
        return legs

    def base_mass(self) -> tuple[float, Array]:
        """Mass of all that is fixed to the body, kg, and its centre in the body frame (3,), m."""
        base = self._model.inertias[1]
        return float(base.mass), np.array(base.lever)

    def foot_positions_m(self, positions: ArrayLike) -> Array:
        """Undersides of the feet in the body frame, (4, 3), m."""
        pin.framesForwardKinematics(self._model, self._data, self._full(positions))
        return np.array([self._data.oMf[frame].translation for frame in self._feet])

    def _full(self, positions: ArrayLike) -> Array:
        self._q[self._q_index] = positions
        return self._q

    def _origin(self, link: str) -> Array:
        """Origin of a link in the body frame (3); that of the body where the machine has no such
        link.
        """
        if not self._model.existFrame(link):
            return np.zeros(3)
        return np.array(self._data.oMf[self._model.getFrameId(link)].translation)

    def _add(self, payload: Payload) -> None:
        if not payload.mass_kg > 0.0:
            raise InputError(
                "must be positive", field="payload.mass_kg", value=payload.mass_kg, allowed="> 0 kg"
            )
        lump = pin.Inertia(
            payload.mass_kg, np.array(payload.point_in_body_m, dtype=float), np.zeros((3, 3))
        )
        self._model.appendBodyToJoint(
            self._model.getJointId("root_joint"), lump, pin.SE3.Identity()
        )


def _foot_radii(text: str) -> Array:
    links = {link.get("name"): link for link in ElementTree.fromstring(text).findall("link")}
    return np.array([sphere_radius_m(links[f"{leg}_foot"]) for leg in LEGS])


# Roll, pitch, yaw and quaternions as rotations, and how far a body has turned from another
# attitude.


def rotation_from_attitude(rpy: Array) -> Array:
    """Rotation body to world (3, 3) of roll, pitch, yaw, rad: Rz(yaw) Ry(pitch) Rx(roll)."""
    out = np.empty((3, 3))
    write_rotation(rpy, out)
    return out


def rotations_of(quaternions: ArrayLike) -> Array:
    """Rotations (..., 3, 3) of unit quaternions xyzw (..., 4), whatever else they hold."""
    x, y, z, w = np.moveaxis(np.asarray(quaternions, dtype=float), -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternions_of(rotations: Array) -> Array:
    """Quaternions xyzw (n, 4) of rotations (n, 3, 3)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(rotations).as_quat())


@njit
def write_rotation(rpy: Array, out: Array) -> None:
    """Fill `out` (3, 3) by the rotation body to world of roll, pitch, yaw (3), rad."""
    cr, cp, cy = cos(rpy[0]), cos(rpy[1]), cos(rpy[2])
    sr, sp, sy = sin(rpy[0]), sin(rpy[1]), sin(rpy[2])
    out[0, 0], out[0, 1], out[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    out[1, 0], out[1, 1], out[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    out[2, 0], out[2, 1], out[2, 2] = -sp, cp * sr, cp * cr


@njit
def small_turn(relative: Array) -> tuple[float, float, float]:
    """Small rotation, rad, about the x, y and z axes of the attitude from which `relative` (3, 3)
    leads to another.

    On a steep slope roll and yaw angles grow together (pitch is near 90 degrees); rotations about
    body axes do not.
    """
    return (
        0.5 * (relative[2, 1] - relative[1, 2]),
        0.5 * (relative[0, 2] - relative[2, 0]),
        0.5 * (relative[1, 0] - relative[0, 1]),
    )
