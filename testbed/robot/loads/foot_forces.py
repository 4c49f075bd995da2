"""Foot forces from the legs' own motion: what the ground must have pushed for each leg to move as
it did.

A leg hangs on the body by three driven joints and touches the ground with its foot alone, so its
three joint-space equations of motion give the three components of the ground's force. With the
engine's velocities before and after a step and its masses this is the contact force of that step to
rounding (tested against the engine's contact points), without fetching contacts. In the body frame,
e_r along the radial joint, e_z up, f_i = m_i (a_i - g):

    along the vertical joint (-e_z):  -e_z . f_3 = tau_3 - e_z . F
    along the radial joint (e_r):      e_r . (f_2 + f_3) = tau_2 + e_r . F
    about the rotation axis (e_z):     e_z . sum(rho_i x f_i + d/dt I_i w)
                                           = tau_1 + e_z . (rho_F x F)

rho_F is where the ground touches the foot. The normal force is taken along the ground's normal
there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.formats.records import Record, Records, part, quantity
from testbed.machine.names import AXES, JOINTS, ROTATION

XYZ = ("x", "y", "z")
X, Y, Z = 0, 1, 2
TURN, OUT, DOWN = 0, 1, 2
"""The joints of a leg, from its first one on, and the links that go with them."""
NOTHING_N = 1e-2
"""Rounding: a force below this is no contact."""


class Link(Record):
    """One link of a leg: what moves with its joint."""

    centre = quantity("m", "centre of mass from the hip, all joints at 0, body frame", per=XYZ)
    mass = quantity("kg", "mass")
    inertia = quantity(
        "kg m2", "principal moments in the link's frame, which turns with the rotation", per=XYZ
    )


class LegNumbers(Record):
    """Masses, centres and axes of a leg."""

    hip = quantity("m", "rotation axis, from the point whose `lift` is given, body frame", per=XYZ)
    radial = quantity("1", "direction of the radial joint at rotation 0, body frame", per=XYZ)
    links = part(Link, "the three links, from the hip out", per=JOINTS)
    yaw = quantity("rad", "direction of the links' x axis at rotation 0")
    foot = quantity(
        "m", "centre of the foot's sphere from the hip, all joints at 0", per=("x", "y")
    )
    foot_radius = quantity(
        "m", "of the foot's sphere: the ground touches its lowest point along the normal"
    )


class JointMotion(Record):
    """How the twelve joints move, and what drives them."""

    position = quantity("m", "position (rotation: rad)", per=AXES)
    rate = quantity("m/s", "rate (rotation: rad/s)", per=AXES)
    acceleration = quantity("m/s2", "change of the rate (rotation: rad/s2)", per=AXES)
    torque = quantity("N", "driving force (rotation: torque, N m)", per=AXES)


class BodyMotion(Record):
    """How the body moves; the frame is said where it is used."""

    angular_velocity = quantity("rad/s", "turning", per=XYZ)
    angular_acceleration = quantity("rad/s2", "change of the turning", per=XYZ)
    lift = quantity("m/s2", "acceleration less gravity of the point that hips count from", per=XYZ)


BODY_MOTION = BodyMotion.dtype


class Centre(NamedTuple):
    """Velocity, m/s, and acceleration, m/s2, of a link's centre of mass as seen from the body."""

    vx: float
    vy: float
    vz: float
    ax: float
    ay: float
    az: float


@njit
def turn_z(angle: float, x: float, y: float) -> tuple[float, float]:
    """(x, y) turned about z by `angle`, rad."""
    c, s = math.cos(angle), math.sin(angle)
    return c * x - s * y, s * x + c * y


@njit
def link_motion(leg: LegNumbers, link: int, first: int, joints: JointMotion, rho: Array) -> Centre:
    """How the centre of mass of a link (TURN, OUT, DOWN: the joint that it goes with) moves as seen
    from the body; its place from the hip into `rho` (3), m.

    joints: those of this leg begin at `first`.
    """
    turn, out, down = first + TURN, first + OUT, first + DOWN
    slides, lowers = link >= OUT, link == DOWN
    centre, radial = leg.links[link].centre, leg.radial
    reach = joints.position[out] if slides else 0.0
    rho[X], rho[Y] = turn_z(
        joints.position[turn], centre[X] + radial[X] * reach, centre[Y] + radial[Y] * reach
    )
    rho[Z] = centre[Z] - (joints.position[down] if lowers else 0.0)
    rx, ry = turn_z(joints.position[turn], radial[X], radial[Y])
    turning, turning_change = joints.rate[turn], joints.acceleration[turn]
    out_rate = joints.rate[out] if slides else 0.0
    out_change = joints.acceleration[out] if slides else 0.0
    # about the rotation axis, towards it, across it (Coriolis), along the radial joint
    ax = -turning_change * rho[Y] - turning**2 * rho[X] - 2.0 * turning * ry * out_rate
    ax += rx * out_change
    ay = turning_change * rho[X] - turning**2 * rho[Y] + 2.0 * turning * rx * out_rate
    ay += ry * out_change
    return Centre(
        -turning * rho[Y] + rx * out_rate,
        turning * rho[X] + ry * out_rate,
        -(joints.rate[down] if lowers else 0.0),
        ax,
        ay,
        -(joints.acceleration[down] if lowers else 0.0),
    )


@njit
def link_force(
    leg: LegNumbers,
    link: int,
    first: int,
    joints: JointMotion,
    bodies: Records[BodyMotion],
    force: Array,
    rho: Array,
) -> float:
    """Force m (a - g) of a link (TURN, OUT, DOWN) into `force` (3), its centre from the hip into
    `rho` (3); returns e_z . d/dt (I w), N m.

    a = lift + alpha x s + w x (w x s) + 2 w x v + a', with s the centre from the point whose lift
    is given, v and a' its motion as seen from the turning body (link_motion).

    joints: those of this leg begin at `first`; bodies: (1), in the body frame.
    """
    seen = link_motion(leg, link, first, joints, rho)
    body, moved = bodies[0], leg.links[link]
    alpha, lift = body.angular_acceleration, body.lift
    wx, wy, wz = body.angular_velocity[X], body.angular_velocity[Y], body.angular_velocity[Z]
    sx, sy, sz = leg.hip[X] + rho[X], leg.hip[Y] + rho[Y], leg.hip[Z] + rho[Z]
    ux, uy, uz = wy * sz - wz * sy, wz * sx - wx * sz, wx * sy - wy * sx  # w x s
    vx, vy, vz = seen.vx, seen.vy, seen.vz
    rigid_x = lift[X] + alpha[Y] * sz - alpha[Z] * sy + wy * uz - wz * uy
    rigid_y = lift[Y] + alpha[Z] * sx - alpha[X] * sz + wz * ux - wx * uz
    rigid_z = lift[Z] + alpha[X] * sy - alpha[Y] * sx + wx * uy - wy * ux
    force[X] = moved.mass * (rigid_x + 2 * (wy * vz - wz * vy) + seen.ax)
    force[Y] = moved.mass * (rigid_y + 2 * (wz * vx - wx * vz) + seen.ay)
    force[Z] = moved.mass * (rigid_z + 2 * (wx * vy - wy * vx) + seen.az)
    # turning of the link in its own axes: z is shared, x and y are turned by yaw
    lx, ly = turn_z(-(leg.yaw + joints.position[first + TURN]), wx, wy)
    about_z = moved.inertia[Z] * (alpha[Z] + joints.acceleration[first + TURN])
    return float(about_z + lx * ly * (moved.inertia[Y] - moved.inertia[X]))


@njit
def in_body_frame(rotation: Array, world: BodyMotion, bodies: Records[BodyMotion]) -> None:
    """The motion `world` in the world frame into bodies[0] in the body frame; rotation (3, 3) body
    to world.
    """
    body = bodies[0]
    for axis in range(3):
        turning = turning_change = lift = 0.0
        for of_world in range(3):
            part = rotation[of_world, axis]
            turning += part * world.angular_velocity[of_world]
            turning_change += part * world.angular_acceleration[of_world]
            lift += part * world.lift[of_world]
        body.angular_velocity[axis] = turning
        body.angular_acceleration[axis] = turning_change
        body.lift[axis] = lift


@njit
def foot_forces(
    legs: Records[LegNumbers],
    joints: JointMotion,
    rotation: Array,
    motion: BodyMotion,
    normals: Array,
    out: Array,
    out_normal: Array,
) -> None:
    """Force of the ground on each foot (4, 3), world frame, N, and its part along its ground's
    normal (4).

    joints and rotation (3, 3) before the step, accelerations over it; motion: in the world frame
    over the step; normals (4, 3) of the ground, world frame.
    """
    bodies = np.empty(1, BODY_MOTION)
    in_body_frame(rotation, motion, bodies)
    force, rho = np.empty(3), np.empty(3)
    for place in range(len(ROTATION)):
        leg, first = legs[place], ROTATION[place]
        turn, reach_out = joints.position[first + TURN], joints.position[first + OUT]
        rx, ry = turn_z(turn, leg.radial[X], leg.radial[Y])
        # what is left for the ground: about the rotation axis, along e_r, along e_z
        moment = -joints.torque[first + TURN]
        along = -joints.torque[first + OUT]
        up = joints.torque[first + DOWN]
        for link in range(len(JOINTS)):
            moment += link_force(leg, link, first, joints, bodies, force, rho)
            moment += rho[X] * force[Y] - rho[Y] * force[X]
            if link >= OUT:
                along += rx * force[X] + ry * force[Y]
            if link == DOWN:
                up += force[Z]
        normal_x = normal_y = 0.0
        for axis in range(3):
            normal_x += rotation[axis, X] * normals[place, axis]
            normal_y += rotation[axis, Y] * normals[place, axis]
        # where the ground touches the foot, from the rotation axis; then along e_r and across it
        touch_x, touch_y = turn_z(
            turn, leg.foot[X] + leg.radial[X] * reach_out, leg.foot[Y] + leg.radial[Y] * reach_out
        )
        touch_x, touch_y = (
            touch_x - leg.foot_radius * normal_x,
            touch_y - leg.foot_radius * normal_y,
        )
        reach, aside = touch_x * rx + touch_y * ry, -touch_x * ry + touch_y * rx
        across = (moment + aside * along) / reach
        push_x, push_y = along * rx - across * ry, along * ry + across * rx
        size = math.sqrt(push_x * push_x + push_y * push_y + up * up)
        if size < NOTHING_N:
            push_x = push_y = up = 0.0
        out_normal[place] = 0.0
        for axis in range(3):
            out[place, axis] = (
                rotation[axis, X] * push_x + rotation[axis, Y] * push_y + rotation[axis, Z] * up
            )
            out_normal[place] += out[place, axis] * normals[place, axis]
