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
from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.formats.records import Record, part, quantity
from testbed.machine.names import AXES, JOINTS

XYZ = ("x", "y", "z")
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


@njit
def turn_z(angle: float, x: float, y: float) -> tuple[float, float]:
    """(x, y) turned about z by `angle`, rad."""
    c, s = math.cos(angle), math.sin(angle)
    return c * x - s * y, s * x + c * y


@njit
def link_force(
    leg: Any, i: int, first: int, joints: Any, bodies: Any, force: Any, rho: Any
) -> float:
    """Force m (a - g) of link i (0..2) into `force`, its centre from the hip into `rho`; returns
    e_z . d/dt (I w).

    leg: LegNumbers; joints: JointMotion, of which this leg's begin at `first`; bodies: array of one
    BodyMotion, in the body frame.
    """
    body = bodies[0]
    turn, out, down = joints.position[first], joints.position[first + 1], joints.position[first + 2]
    turning, turning_change = joints.rate[first], joints.acceleration[first]
    link = leg.links[i]
    reach = out if i > 0 else 0.0
    rho[0], rho[1] = turn_z(
        turn, link.centre[0] + leg.radial[0] * reach, link.centre[1] + leg.radial[1] * reach
    )
    rho[2] = link.centre[2] - (down if i == 2 else 0.0)
    rx, ry = turn_z(turn, leg.radial[0], leg.radial[1])
    sliding = i > 0
    out_rate = joints.rate[first + 1] if sliding else 0.0
    out_change = joints.acceleration[first + 1] if sliding else 0.0
    down_rate = joints.rate[first + 2] if i == 2 else 0.0
    down_change = joints.acceleration[first + 2] if i == 2 else 0.0
    # relative velocity and acceleration of the centre in the turning body
    vx, vy, vz = -turning * rho[1] + rx * out_rate, turning * rho[0] + ry * out_rate, -down_rate
    ax = -turning_change * rho[1] - turning**2 * rho[0] - 2.0 * turning * ry * out_rate
    ax += rx * out_change
    ay = turning_change * rho[0] - turning**2 * rho[1] + 2.0 * turning * rx * out_rate
    ay += ry * out_change
    az = -down_change
    sx, sy, sz = leg.hip[0] + rho[0], leg.hip[1] + rho[1], leg.hip[2] + rho[2]
    w, alpha, lift = body.angular_velocity, body.angular_acceleration, body.lift
    wx, wy, wz = w[0], w[1], w[2]
    ux, uy, uz = wy * sz - wz * sy, wz * sx - wx * sz, wx * sy - wy * sx
    m = link.mass
    force[0] = m * (
        lift[0] + alpha[1] * sz - alpha[2] * sy + wy * uz - wz * uy + 2 * (wy * vz - wz * vy) + ax
    )
    force[1] = m * (
        lift[1] + alpha[2] * sx - alpha[0] * sz + wz * ux - wx * uz + 2 * (wz * vx - wx * vz) + ay
    )
    force[2] = m * (
        lift[2] + alpha[0] * sy - alpha[1] * sx + wx * uy - wy * ux + 2 * (wx * vy - wy * vx) + az
    )
    # turning of the link in its own axes: z is shared, x and y are turned by yaw
    lx, ly = turn_z(-(leg.yaw + turn), wx, wy)
    ix, iy, iz = link.inertia[0], link.inertia[1], link.inertia[2]
    return float(iz * (alpha[2] + turning_change) + lx * ly * (iy - ix))


@njit
def in_body_frame(rotation: Any, world: Any, bodies: Any) -> None:
    """BodyMotion `world` of the world frame into bodies[0] of the body frame; rotation (3, 3) body
    to world.
    """
    body = bodies[0]
    for index in range(3):
        w = alpha = lift = 0.0
        for j in range(3):
            w += rotation[j, index] * world.angular_velocity[j]
            alpha += rotation[j, index] * world.angular_acceleration[j]
            lift += rotation[j, index] * world.lift[j]
        body.angular_velocity[index] = w
        body.angular_acceleration[index] = alpha
        body.lift[index] = lift


@njit
def foot_forces(
    legs: Any, joints: Any, rotation: Any, motion: Any, normals: Any, out: Any, out_normal: Any
) -> None:
    """Force of the ground on each foot (4, 3), world frame, N, and its part along its ground's
    normal (4).

    legs (4) LegNumbers; joints (JointMotion) and rotation (3, 3) before the step, accelerations
    over it; motion: BodyMotion in the world frame over the step; normals (4, 3) of the ground,
    world frame.
    """
    bodies = np.empty(1, BODY_MOTION)
    in_body_frame(rotation, motion, bodies)
    force, rho = np.empty(3), np.empty(3)
    for index in range(4):
        leg, first = legs[index], 3 * index
        turn, reach_out = joints.position[first], joints.position[first + 1]
        rx, ry = turn_z(turn, leg.radial[0], leg.radial[1])
        moment = -joints.torque[first]
        along = -joints.torque[first + 1]
        up = joints.torque[first + 2]
        for i in range(3):
            moment += link_force(leg, i, first, joints, bodies, force, rho)
            moment += rho[0] * force[1] - rho[1] * force[0]
            if i > 0:
                along += rx * force[0] + ry * force[1]
            if i == 2:
                up += force[2]
        nx = ny = 0.0
        for j in range(3):
            nx += rotation[j, 0] * normals[index, j]
            ny += rotation[j, 1] * normals[index, j]
        fx, fy = turn_z(
            turn, leg.foot[0] + leg.radial[0] * reach_out, leg.foot[1] + leg.radial[1] * reach_out
        )
        fx, fy = fx - leg.foot_radius * nx, fy - leg.foot_radius * ny
        reach, aside = fx * rx + fy * ry, -fx * ry + fy * rx
        across = (moment + aside * along) / reach
        bx, by = along * rx - across * ry, along * ry + across * rx
        size = math.sqrt(bx * bx + by * by + up * up)
        if size < NOTHING_N:
            bx = by = up = 0.0
        out_normal[index] = 0.0
        for j in range(3):
            out[index, j] = rotation[j, 0] * bx + rotation[j, 1] * by + rotation[j, 2] * up
            out_normal[index] += out[index, j] * normals[index, j]
