"""Everything between two engine steps that is not a rigid body, in one compiled call.

Order: linkage -> ropes and traction -> hydraulics in substeps -> joint torques -> wrench on the body.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.laws import columns as c
from testbed.laws import drill as d
from testbed.laws import traction as tr
from testbed.laws.hydraulics import hydraulic_step
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.laws.rope import rope_wrench
from testbed.robot.linkage import joint_to_cylinder
from testbed.robot.loads.foot_forces import BODY_MOTION, JOINT_MOTION, foot_forces

# --- columns of a rope (2 x ROPE_COLUMNS) ---------------------------------------------------------------------
ANCHOR, ATTACH = slice(0, 3), slice(3, 6)
(UNSTRAINED, EA, DAMPING, BREAKING, WHOLE, RATE_COMMAND, RATE, TENSION) = range(6, 14)
ROPE_FORCE = slice(14, 17)
(WEIGHT, CLEARANCE) = range(17, 19)
TRACTION = slice(19, 19 + tr.TRACTION_STATES)
ROPE_COLUMNS = 19 + tr.TRACTION_STATES
# --- body numbers (BODY_COLUMNS) ------------------------------------------------------------------------------
COM, DRILL_POINT = slice(0, 3), slice(3, 6)
DRILL_PHASE = 6
SHOVE = slice(7, 10)
TRACTION_NUMBERS = slice(10, 10 + tr.TRACTION_NUMBERS)
BODY_COLUMNS = 10 + tr.TRACTION_NUMBERS


@njit
def rotation_matrix(quaternion: Any, out: Any) -> None:
    """Body-to-world rotation (3, 3) of a quaternion xyzw."""
    x, y, z, w = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    out[0, 0], out[0, 1], out[0, 2] = (
        1 - 2 * (y * y + z * z),
        2 * (x * y - z * w),
        2 * (x * z + y * w),
    )
    out[1, 0], out[1, 1], out[1, 2] = (
        2 * (x * y + z * w),
        1 - 2 * (x * x + z * z),
        2 * (y * z - x * w),
    )
    out[2, 0], out[2, 1], out[2, 2] = (
        2 * (x * z - y * w),
        2 * (y * z + x * w),
        1 - 2 * (x * x + y * y),
    )


@njit
def move_base(pose: Any, turn: Any, base: Any, dt: float, at_rest: bool) -> None:
    """Take over the engine's pose (7) of the base's principal axes (turned by `turn` in the body) into base (13).

    The engine moves a body by its new velocity over the whole step, so the difference of two poses is that velocity,
    exactly; it is not asked for.
    """
    x, y, z, w = pose[3], pose[4], pose[5], pose[6]
    tx, ty, tz, tw = -turn[0], -turn[1], -turn[2], turn[3]
    qx = w * tx + x * tw + y * tz - z * ty
    qy = w * ty - x * tz + y * tw + z * tx
    qz = w * tz + x * ty - y * tx + z * tw
    qw = w * tw - x * tx - y * ty - z * tz
    if at_rest:
        for i in range(7, 13):
            base[i] = 0.0
    else:
        px, py, pz, pw = -base[3], -base[4], -base[5], base[6]
        dx = qw * px + qx * pw + qy * pz - qz * py
        dy = qw * py - qx * pz + qy * pw + qz * px
        dz = qw * pz + qx * py - qy * px + qz * pw
        dw = qw * pw - qx * px - qy * py - qz * pz
        size = (dx * dx + dy * dy + dz * dz) ** 0.5
        rate = 2.0 / dt if size < 1e-12 else 2.0 * math.atan2(size, abs(dw)) / (size * dt)
        rate = rate if dw >= 0.0 else -rate
        base[10], base[11], base[12] = rate * dx, rate * dy, rate * dz
        for i in range(3):
            base[7 + i] = (pose[i] - base[i]) / dt
    base[0], base[1], base[2] = pose[0], pose[1], pose[2]
    base[3], base[4], base[5], base[6] = qx, qy, qz, qw


@njit
def feet_under_motion(
    legs: Any,
    q: Any,
    qd: Any,
    qd_after: Any,
    torque: Any,
    rotation: Any,
    w: Any,
    alpha: Any,
    lift: Any,
    normals: Any,
    foot_force: Any,
    normal_force: Any,
    dt: float,
) -> None:
    """foot_forces.foot_forces with the joints' accelerations from their rates before and after the step."""
    joints, body = np.empty(1, JOINT_MOTION), np.empty(1, BODY_MOTION)
    for i in range(q.shape[0]):
        joints[0].position[i], joints[0].rate[i], joints[0].torque[i] = q[i], qd[i], torque[i]
        joints[0].acceleration[i] = (qd_after[i] - qd[i]) / dt
    for i in range(3):
        body[0].angular_velocity[i], body[0].angular_acceleration[i] = w[i], alpha[i]
        body[0].lift[i] = lift[i]
    _feet(legs, joints, rotation, body, normals, foot_force, normal_force)


@njit
def _feet(
    legs: Any, joints: Any, rotation: Any, body: Any, normals: Any, force: Any, normal: Any
) -> None:
    foot_forces(legs, joints[0], rotation, body[0], normals, force, normal)


@njit
def add_cross(r: Any, f: Any, out: Any) -> None:
    """out += r x f."""
    out[0] += r[1] * f[2] - r[2] * f[1]
    out[1] += r[2] * f[0] - r[0] * f[2]
    out[2] += r[0] * f[1] - r[1] * f[0]


@njit
def rope_step(
    rope: Any, base: Any, rotation: Any, body: Any, supply: Any, dt: float, force: Any, torque: Any
) -> float:
    """One rope: haul and pull on the body. Adds to force and torque (about the base's COM); returns oil taken, m3/s."""
    arm, point, velocity = np.empty(3), np.empty(3), np.empty(3)
    for i in range(3):
        arm[i] = 0.0
        for j in range(3):
            arm[i] += rotation[i, j] * (rope[3 + j] - body[j])
        point[i] = base[i] + arm[i]
        velocity[i] = base[7 + i]
    add_cross(base[10:13], arm, velocity)
    device, numbers = rope[19:], body[10:]
    place = device[tr.PLACE]
    rope[RATE] = tr.traction_step(
        device, numbers, rope[RATE_COMMAND], rope[TENSION], supply[c.P_SUPPLY] - ATMOSPHERE_PA, dt
    )
    rope[UNSTRAINED] += dt * rope[RATE]
    out = rope[14:17]
    if rope[WHOLE] == 0.0:
        out[0] = out[1] = out[2] = 0.0
        rope[TENSION] = 0.0
        return 0.0
    rope[TENSION] = rope_wrench(
        point,
        rope[0:3],
        velocity,
        rope[UNSTRAINED],
        rope[EA],
        rope[DAMPING],
        rope[WEIGHT],
        rope[CLEARANCE],
        out,
    )
    if rope[TENSION] > rope[BREAKING]:
        rope[WHOLE] = 0.0
    for i in range(3):
        force[i] += out[i]
    add_cross(arm, out, torque)
    return float(tr.oil_taken(device, numbers, rope[RATE], place, dt))


@njit
def drill_step(
    drill: Any,
    base: Any,
    rotation: Any,
    body: Any,
    dt: float,
    g: float,
    wrench: Any,
    force: Any,
    torque: Any,
) -> None:
    """The drill's reaction on the body: adds to force and torque, leaves its own wrench (about the drill point)."""
    phase = body[DRILL_PHASE] + dt * drill[d.BLOW_HZ]
    axial = d.axial_force(drill, body[DRILL_PHASE], phase, -g * rotation[2, 2])
    body[DRILL_PHASE] = phase
    arm = np.empty(3)
    for i in range(3):
        arm[i] = 0.0
        for j in range(3):
            arm[i] += rotation[i, j] * (body[3 + j] - body[j])
        wrench[i] = axial * rotation[i, 2]
        wrench[3 + i] = -drill[d.TORQUE] * rotation[i, 2]
    weight = drill[d.MAST_KG] * g
    wrench[2] -= weight
    wrench[3] -= drill[d.MAST_HEIGHT] * rotation[1, 2] * weight
    wrench[4] += drill[d.MAST_HEIGHT] * rotation[0, 2] * weight
    for i in range(3):
        force[i] += wrench[i]
        torque[i] += wrench[3 + i]
    add_cross(arm, wrench[0:3], torque)


@njit(apart=True)
def plant_step(
    q: Any,
    qd: Any,
    base: Any,
    command: Any,
    foot_force: Any,
    axes: Any,
    params: Any,
    supply: Any,
    unit: Any,
    geometry: Any,
    ropes: Any,
    body: Any,
    drill: Any,
    scratch: Any,
    rotation: Any,
    joint_torque: Any,
    force: Any,
    torque: Any,
    drill_wrench: Any,
    dt: float,
    substeps: int,
    gravity: float,
) -> None:
    """From the engine's state to what the engine is given for the next step.

    In: q, qd (12), base (13, Engine.read), command (12), foot_force (4, 3) of the last step. State, in place: axes,
    supply, ropes, body. Out: joint_torque (12), force, torque (3) on the base's centre of mass, world frame;
    drill_wrench (6); scratch (6, 12): extension, rate, arm, axial load, side load, raw rate.
    """
    x, v, arms, load, side = scratch[0], scratch[1], scratch[2], scratch[3], scratch[4]
    joint_to_cylinder(q, geometry, x, arms)
    for leg in range(4):
        f = foot_force[leg]
        along = f[0] * rotation[0, 2] + f[1] * rotation[1, 2] + f[2] * rotation[2, 2]
        total = f[0] * f[0] + f[1] * f[1] + f[2] * f[2]
        across = max(total - along * along, 0.0) ** 0.5
        for k in range(3):
            i = 3 * leg + k
            v[i] = qd[i] * arms[i]
            load[i] = along if k == 2 else 0.0
            side[i] = across if k == 2 else abs(along) if k == 1 else 0.0
    for i in range(3):
        force[i] = body[7 + i]
        torque[i] = 0.0
    taken = 0.0
    for k in range(ropes.shape[0]):
        taken += rope_step(ropes[k], base, rotation, body, supply, dt, force, torque)
    supply[c.TRACTION_FLOW] = taken
    drill_step(drill, base, rotation, body, dt, gravity, drill_wrench, force, torque)
    hydraulic_step(axes, params, supply, unit, x, v, command, load, side, dt, substeps)
    for i in range(q.shape[0]):
        joint_torque[i] = axes[i, c.FORCE] * arms[i]


@njit
def write_truth(
    row: Any,
    t: float,
    base: Any,
    com: Any,
    rotation: Any,
    foot_force: Any,
    normal: Any,
    ropes: Any,
    drill_wrench: Any,
    axes: Any,
    supply: Any,
    drill: Any,
) -> None:
    """One row of truth.parquet (columns: simulation.TRUTH_COLUMNS)."""
    row[0] = t
    for i in range(3):
        row[1 + i] = base[i] - (
            rotation[i, 0] * com[0] + rotation[i, 1] * com[1] + rotation[i, 2] * com[2]
        )
    for i in range(4):
        row[4 + i] = base[3 + i]
    for leg in range(4):
        f = foot_force[leg]
        for i in range(3):
            row[8 + 3 * leg + i] = f[i]
        row[20 + leg] = f[0] * rotation[0, 2] + f[1] * rotation[1, 2] + f[2] * rotation[2, 2]
        row[24 + leg] = normal[leg]
    for i in range(3):
        row[28 + i] = ropes[0, 14 + i]
        row[31 + i] = ropes[1, 14 + i]
    for i in range(6):
        row[34 + i] = drill_wrench[i]
    n = axes.shape[0]
    for i in range(n):
        row[40 + i] = axes[i, c.FRICTION]
        row[52 + i] = axes[i, c.P_A] - ATMOSPHERE_PA
        row[64 + i] = axes[i, c.P_B] - ATMOSPHERE_PA
    row[76] = supply[c.P_SUPPLY] - ATMOSPHERE_PA
    row[77] = supply[c.TEMPERATURE]
    row[78] = drill[d.DEPTH]
    row[79] = drill[d.STRING_KG] + drill[d.MAST_KG]
    for k in range(2):
        row[80 + k] = ropes[k, 19 + tr.PLACE]
        row[82 + k] = ropes[k, 19 + tr.MODE]
