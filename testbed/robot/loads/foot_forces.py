"""Foot forces from the legs' own motion: what the ground must have pushed for each leg to move as it did.

A leg hangs on the body by three driven joints and touches the ground with its foot alone, so its three joint-space
equations of motion give the three components of the ground's force. With the engine's velocities before and after a
step and its masses this is the contact force of that step to rounding (tested against the engine's contact points),
without fetching contacts. In the body frame, e_r along the radial joint, e_z up, f_i = m_i (a_i - g):

    along the vertical joint (-e_z):   -e_z . f_3                 = tau_3 - e_z . F
    along the radial joint (e_r):       e_r . (f_2 + f_3)         = tau_2 + e_r . F
    about the rotation axis (e_z):      e_z . sum(rho_i x f_i + d/dt I_i w) = tau_1 + e_z . (rho_F x F)

rho_F is where the ground touches the foot. The normal force is taken along the ground's normal there.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from testbed.compiled import njit

# --- columns of a leg (4 x LEG_COLUMNS) ---------------------------------------------------------------------
HIP = 0
"""Rotation axis, from the point whose acceleration is given as `lift`, body frame (3)."""
RADIAL = 3
"""Direction of the radial joint at rotation 0 (3)."""
CENTRES = 6
"""Centres of mass of the three links from the hip with all joints at 0 (3 x 3)."""
MASSES = 15
INERTIAS = 18
"""Principal moments of the three links in their own frame, which turns with the rotation joint (3 x 3)."""
YAW = 27
"""Direction of the links' x axis at rotation 0, rad."""
FOOT = 28
"""Centre of the foot's sphere from the hip with all joints at 0, x and y (2)."""
RADIUS = 30
"""Radius of the foot's sphere: the ground touches it at its lowest point along the ground's normal."""
LEG_COLUMNS = 31
NOTHING_N = 1e-2
"""Rounding: a force below this is no contact."""


@njit
def turn_z(angle: float, x: float, y: float) -> tuple[float, float]:
    """(x, y) turned about z by `angle`, rad."""
    c, s = math.cos(angle), math.sin(angle)
    return c * x - s * y, s * x + c * y


@njit
def link_force(
    leg: Any, i: int, q: Any, qd: Any, qdd: Any, w: Any, alpha: Any, lift: Any, force: Any, rho: Any
) -> float:
    """Force m (a - g) of link i (0..2) into `force`, its centre from the hip into `rho`; returns e_z . d/dt (I w).

    q, qd, qdd (3): joints of this leg. w, alpha, lift (3): the body's turning, its change, and the acceleration less
    gravity of the point that HIP counts from, all in the body frame.
    """
    k = CENTRES + 3 * i
    reach = q[1] if i > 0 else 0.0
    rho[0], rho[1] = turn_z(
        q[0], leg[k] + leg[RADIAL] * reach, leg[k + 1] + leg[RADIAL + 1] * reach
    )
    rho[2] = leg[k + 2] - (q[2] if i == 2 else 0.0)
    rx, ry = turn_z(q[0], leg[RADIAL], leg[RADIAL + 1])
    out, out_rate = (qd[1], qdd[1]) if i > 0 else (0.0, 0.0)
    down, down_rate = (qd[2], qdd[2]) if i == 2 else (0.0, 0.0)
    # relative velocity and acceleration of the centre in the turning body
    vx, vy, vz = -qd[0] * rho[1] + rx * out, qd[0] * rho[0] + ry * out, -down
    ax = -qdd[0] * rho[1] - qd[0] ** 2 * rho[0] - 2.0 * qd[0] * ry * out + rx * out_rate
    ay = qdd[0] * rho[0] - qd[0] ** 2 * rho[1] + 2.0 * qd[0] * rx * out + ry * out_rate
    az = -down_rate
    sx, sy, sz = leg[HIP] + rho[0], leg[HIP + 1] + rho[1], leg[HIP + 2] + rho[2]
    wx, wy, wz = w[0], w[1], w[2]
    ux, uy, uz = wy * sz - wz * sy, wz * sx - wx * sz, wx * sy - wy * sx
    m = leg[MASSES + i]
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
    yaw = leg[YAW] + q[0]
    lx, ly = turn_z(-yaw, wx, wy)
    n = INERTIAS + 3 * i
    return float(leg[n + 2] * (alpha[2] + qdd[0]) + lx * ly * (leg[n + 1] - leg[n]))


@njit
def foot_forces(
    legs: Any,
    q: Any,
    qd: Any,
    qdd: Any,
    torque: Any,
    rotation: Any,
    w_world: Any,
    alpha_world: Any,
    lift_world: Any,
    normals: Any,
    out: Any,
    out_normal: Any,
) -> None:
    """Force of the ground on each foot (4, 3), world frame, N, and its part along its ground's normal (4).

    q, qd (12) and rotation (3, 3) before the step; qdd (12), alpha and lift (3, world) its changes of velocity over
    its length, lift less gravity; torque (12) what drove the joints.
    """
    w, alpha, lift = np.empty(3), np.empty(3), np.empty(3)
    for k in range(3):
        w[k] = alpha[k] = lift[k] = 0.0
        for j in range(3):
            w[k] += rotation[j, k] * w_world[j]
            alpha[k] += rotation[j, k] * alpha_world[j]
            lift[k] += rotation[j, k] * lift_world[j]
    force, rho = np.empty(3), np.empty(3)
    for leg in range(4):
        p, a = legs[leg], slice(3 * leg, 3 * leg + 3)
        rx, ry = turn_z(q[3 * leg], p[RADIAL], p[RADIAL + 1])
        moment = -torque[3 * leg]
        along = -torque[3 * leg + 1]
        up = torque[3 * leg + 2]
        for i in range(3):
            moment += link_force(p, i, q[a], qd[a], qdd[a], w, alpha, lift, force, rho)
            moment += rho[0] * force[1] - rho[1] * force[0]
            if i > 0:
                along += rx * force[0] + ry * force[1]
            if i == 2:
                up += force[2]
        nx = (
            rotation[0, 0] * normals[leg, 0]
            + rotation[1, 0] * normals[leg, 1]
            + rotation[2, 0] * normals[leg, 2]
        )
        ny = (
            rotation[0, 1] * normals[leg, 0]
            + rotation[1, 1] * normals[leg, 1]
            + rotation[2, 1] * normals[leg, 2]
        )
        fx, fy = turn_z(
            q[3 * leg],
            p[FOOT] + p[RADIAL] * q[3 * leg + 1],
            p[FOOT + 1] + p[RADIAL + 1] * q[3 * leg + 1],
        )
        fx, fy = fx - p[RADIUS] * nx, fy - p[RADIUS] * ny
        reach, aside = fx * rx + fy * ry, -fx * ry + fy * rx
        across = (moment + aside * along) / reach
        bx, by = along * rx - across * ry, along * ry + across * rx
        size = math.sqrt(bx * bx + by * by + up * up)
        if size < NOTHING_N:
            bx = by = up = 0.0
        out_normal[leg] = 0.0
        for k in range(3):
            out[leg, k] = rotation[k, 0] * bx + rotation[k, 1] * by + rotation[k, 2] * up
            out_normal[leg] += out[leg, k] * normals[leg, k]
