"""Everything between two engine steps that is not a rigid body, in one compiled call.

Order: linkage -> ropes and traction -> hydraulics in substeps -> joint torques -> wrench on the
body.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.laws.coupling import centre_window
from testbed.laws.drill import axial_force
from testbed.laws.hydraulics import hydraulic_step
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.laws.rope import rope_pull, slip_through
from testbed.laws.traction import oil_taken, traction_step
from testbed.machine.names import AXES, GRAVITY_M_S2, JOINTS, LEGS, ROTATION, SIDES, VERTICAL
from testbed.recording.rows import TruthRow
from testbed.robot.linkage import joint_to_cylinder
from testbed.robot.loads.foot_forces import foot_forces, turn_z
from testbed.world.board import Board, BodyState, EngineState

RADIAL = JOINTS.index("radial")
NO_TURN = 1e-12
"""Sine of half the angle below which a rotation counts as none."""


class Quaternion(NamedTuple):
    """A rotation as a quaternion, xyzw."""

    x: float
    y: float
    z: float
    w: float


@njit
def quaternion_of(values: Array) -> Quaternion:
    """The quaternion of an array xyzw (4)."""
    return Quaternion(values[0], values[1], values[2], values[3])


@njit
def turned_back(q: Quaternion, turn: Quaternion) -> Quaternion:
    """The rotation `q` after the inverse of `turn`: q times the conjugate of `turn`."""
    x, y, z, w = -turn.x, -turn.y, -turn.z, turn.w
    return Quaternion(
        q.w * x + q.x * w + q.y * z - q.z * y,
        q.w * y - q.x * z + q.y * w + q.z * x,
        q.w * z + q.x * y - q.y * x + q.z * w,
        q.w * w - q.x * x - q.y * y - q.z * z,
    )


@njit
def rotation_matrix(quaternion: Array, out: Array) -> None:
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
def move_body(body: BodyState, engine: EngineState, turn: Array, dt: float, at_rest: bool) -> None:
    """Update the body from the engine's pose of its principal axes, which are turned by `turn` (4,
    xyzw) against the body.

    The engine moves a body with its new velocity during the whole step. The velocities therefore
    follow exactly from the difference of two poses.
    """
    now = turned_back(quaternion_of(engine.quaternion), quaternion_of(turn))
    angular_velocity, pose = body.angular_velocity, body.quaternion
    if at_rest:
        for i in range(3):
            body.velocity[i] = angular_velocity[i] = 0.0
    else:
        change = turned_back(now, quaternion_of(pose))
        size = (change.x * change.x + change.y * change.y + change.z * change.z) ** 0.5
        rate = 2.0 / dt if size < NO_TURN else 2.0 * math.atan2(size, abs(change.w)) / (size * dt)
        rate = rate if change.w >= 0.0 else -rate  # the shorter of the two rotations
        angular_velocity[0] = rate * change.x
        angular_velocity[1] = rate * change.y
        angular_velocity[2] = rate * change.z
        for i in range(3):
            body.velocity[i] = (engine.position[i] - body.position[i]) / dt
    for i in range(3):
        body.position[i] = engine.position[i]
    pose[0], pose[1], pose[2], pose[3] = now.x, now.y, now.z, now.w


@njit
def follow_engine(board: Board, at_rest: bool, feet: bool) -> None:
    """Update the body's pose and motion from the engine after a step (or, at rest, before the first
    one), and with `feet` the forces on the feet.
    """
    dt, body, motion = board.clock.step_s, board.body, board.motion
    velocity, angular_velocity = np.empty(3), motion.angular_velocity
    for i in range(3):
        velocity[i], angular_velocity[i] = body.velocity[i], body.angular_velocity[i]
    move_body(body, board.engine, board.base_turn, dt, at_rest)
    for i in range(3):
        motion.lift[i] = 0.0 if at_rest else (body.velocity[i] - velocity[i]) / dt
        change = 0.0 if at_rest else (body.angular_velocity[i] - angular_velocity[i]) / dt
        motion.angular_acceleration[i] = change
    motion.lift[2] += GRAVITY_M_S2
    if not at_rest:
        board.clock.step += 1
    if feet:
        joints = board.before
        for i in range(len(AXES)):
            joints.acceleration[i] = (board.engine.joint_rate[i] - joints.rate[i]) / dt
            joints.torque[i] = board.given.joint_torque[i]
        foot_forces(
            board.legs,
            joints,
            board.rotation,
            motion,
            board.ground_normals,
            board.foot_force,
            board.normal_force,
        )
    rotation_matrix(body.quaternion, board.rotation)


@njit
def add_cross(r: Array, f: Array, out: Array) -> None:
    """Out += r x f."""
    out[0] += r[1] * f[2] - r[2] * f[1]
    out[1] += r[2] * f[0] - r[0] * f[2]
    out[2] += r[0] * f[1] - r[1] * f[0]


@njit
def along_body_z(force: Array, rotation: Array) -> float:
    """Part of a force (3), world frame, along the body's z axis, N: the vertical joints' axis."""
    return float(force[0] * rotation[0, 2] + force[1] * rotation[1, 2] + force[2] * rotation[2, 2])


@njit
def arm_of(board: Board, point: Array, arm: Array) -> None:
    """Way from the base's centre of mass to a point of the body frame (3), world frame, into `arm`
    (3).
    """
    for i in range(3):
        arm[i] = 0.0
        for j in range(3):
            arm[i] += board.rotation[i, j] * (point[j] - board.base_centre[j])


@njit
def rope_step(board: Board, k: int) -> float:
    """Rope k: haul and pull on the body. Adds to the given force and torque; returns oil taken,
    m3/s.
    """
    rope, device, body, dt = board.ropes[k], board.devices[k], board.body, board.clock.step_s
    arm, point, velocity = np.empty(3), np.empty(3), np.empty(3)
    arm_of(board, rope.attachment, arm)
    for i in range(3):
        point[i] = body.position[i] + arm[i]
        velocity[i] = body.velocity[i]
    add_cross(body.angular_velocity, arm, velocity)
    place = device.place
    supply_gauge = board.supply.pressure - ATMOSPHERE_PA
    rope.rate = traction_step(
        device, board.traction, rope.wanted_rate, rope.tension, supply_gauge, dt
    )
    rope.unstrained += dt * rope.rate
    pull = rope.force
    if rope.whole == 0.0:
        pull[0] = pull[1] = pull[2] = 0.0
        rope.tension = 0.0
        return 0.0
    rope.tension = rope_pull(rope, point, velocity)
    if rope.tension > rope.breaking_load:
        rope.whole = 0.0
    else:
        device.slipped += slip_through(rope, board.traction.hold)
    for i in range(3):
        board.given.force[i] += pull[i]
    add_cross(arm, pull, board.given.torque)
    return oil_taken(device, board.traction, rope.rate, place, dt)


@njit
def drill_step(board: Board) -> None:
    """The drill's reaction on the body: adds to the given force and torque, leaves its own
    wrench.
    """
    drill, rotation, wrench = board.drill, board.rotation, board.drill_wrench
    phase = board.drill_phase + board.clock.step_s * drill.blow_rate
    axial = axial_force(drill, board.drill_phase, phase, -GRAVITY_M_S2 * rotation[2, 2])
    board.drill_phase = phase
    arm = np.empty(3)
    arm_of(board, board.drill_point, arm)
    force, torque = wrench[:3], wrench[3:]
    for i in range(3):
        force[i] = axial * rotation[i, 2]
        torque[i] = -drill.torque * rotation[i, 2]
    weight = drill.mast_mass * GRAVITY_M_S2
    force[2] -= weight
    torque[0] -= drill.mast_height * rotation[1, 2] * weight
    torque[1] += drill.mast_height * rotation[0, 2] * weight
    for i in range(3):
        board.given.force[i] += force[i]
        board.given.torque[i] += torque[i]
    add_cross(arm, force, board.given.torque)


@njit
def move_rods(board: Board) -> None:
    """Extension, rate and loads of the twelve rods from the joints and the foot forces.

    The rods run through where the engine has them, in the middle of the hydraulics' step:
    coupling.py says why.
    """
    joint_to_cylinder(board.engine.joint, board.linkages, board.extension, board.arms)
    rotation = board.rotation
    for leg in range(len(LEGS)):
        push = board.foot_force[leg]
        along = along_body_z(push, rotation)
        total = push[0] * push[0] + push[1] * push[1] + push[2] * push[2]
        across = max(total - along * along, 0.0) ** 0.5
        first = ROTATION[leg]
        for axis in range(first, first + len(JOINTS)):
            rate = board.engine.joint_rate[axis] * board.arms[axis]
            centre_window(board.inputs[axis], board.extension[axis], rate, board.clock.step_s)
            board.inputs[axis].load = board.inputs[axis].side_load = 0.0
        board.inputs[first + RADIAL].side_load = abs(along)
        vertical = VERTICAL[leg]
        board.inputs[vertical].load = along / board.arms[vertical]
        board.inputs[vertical].side_load = across


@njit
def push_foot(board: Board, leg: int) -> None:
    """Somebody's force on a foot's underside, as what it does to the leg's joints and to the body:
    adds to the given torques and force.
    """
    numbers, push, first = board.legs[leg], board.foot_shove[leg], ROTATION[leg]
    turn, reach, down = (
        board.engine.joint[first],
        board.engine.joint[first + 1],
        board.engine.joint[first + 2],
    )
    rx, ry = turn_z(turn, numbers.radial[0], numbers.radial[1])
    x, y = turn_z(turn, numbers.foot[0], numbers.foot[1])
    x, y = x + rx * reach, y + ry * reach
    force, place, arm = np.zeros(3), np.empty(3), np.zeros(3)
    place[0], place[1] = numbers.hip[0] + x, numbers.hip[1] + y
    place[2] = board.foot_height[leg] - down
    for i in range(3):
        for j in range(3):
            force[i] += board.rotation[j, i] * push[j]
            arm[i] += board.rotation[i, j] * place[j]
    given = board.given
    given.joint_torque[first] += x * force[1] - y * force[0]
    given.joint_torque[first + 1] += rx * force[0] + ry * force[1]
    given.joint_torque[first + 2] -= force[2]
    for i in range(3):
        given.force[i] += push[i]
    add_cross(arm, push, given.torque)


@njit
def step_cylinders(board: Board) -> None:
    """The hydraulics of all twelve cylinders and their supply, one step of the clock."""
    hydraulic_step(
        board.axes,
        board.parameters,
        board.inputs,
        board.supply,
        board.unit,
        board.clock.step_s,
        board.clock.substeps,
    )


@njit
def plant_step(board: Board) -> None:
    """From the engine's state to what the engine is given for the next step."""
    before, given = board.before, board.given
    for i in range(len(AXES)):
        before.position[i], before.rate[i] = board.engine.joint[i], board.engine.joint_rate[i]
    move_rods(board)
    for i in range(3):
        given.force[i] = board.shove[i]
        given.torque[i] = 0.0
    taken = hauled = 0.0
    for k in range(len(SIDES)):
        taken += rope_step(board, k)
        if board.ropes[k].wanted_rate < 0.0:
            hauled = max(hauled, board.ropes[k].tension)
    board.supply.traction_flow = taken
    board.supply.traction_load = hauled / board.traction.area
    drill_step(board)
    step_cylinders(board)
    for i in range(len(AXES)):
        given.joint_torque[i] = board.axes[i].force * board.arms[i]
    for leg in range(len(LEGS)):
        if board.foot_shove[leg].any():
            push_foot(board, leg)


@njit
def write_truth(row: TruthRow, board: Board, t: float) -> None:
    """Fill a row of truth at the time t, s."""
    rotation, body, centre = board.rotation, board.body, board.base_centre
    row.t = t
    pose = row.body_pose_in_world
    for i in range(3):
        pose[i] = body.position[i] - (
            rotation[i, 0] * centre[0] + rotation[i, 1] * centre[1] + rotation[i, 2] * centre[2]
        )
    for i in range(4):
        pose[3 + i] = body.quaternion[i]
    for leg in range(len(LEGS)):
        f = board.foot_force[leg]
        for i in range(3):
            row.foot_force_in_world[leg, i] = f[i]
        row.foot_load[leg] = along_body_z(f, rotation)
        row.contact_normal[leg] = board.normal_force[leg]
    for i in range(6):
        row.drill_wrench_in_world[i] = board.drill_wrench[i]
    for i in range(len(AXES)):
        axis = board.axes[i]
        row.friction[i] = axis.friction
        row.chamber_a[i] = axis.a.pressure - ATMOSPHERE_PA
        row.chamber_b[i] = axis.b.pressure - ATMOSPHERE_PA
    row.supply_pressure = board.supply.pressure - ATMOSPHERE_PA
    row.oil_temperature = board.supply.temperature
    row.pump_power = board.supply.pump_power
    row.hole_depth = board.drill.depth
    row.drill_string_mass = board.drill.string_mass + board.drill.mast_mass
    for k in range(len(SIDES)):
        for i in range(3):
            row.rope_force_in_world[k, i] = board.ropes[k].force[i]
        row.traction_stroke[k] = board.devices[k].place
        row.traction_mode[k] = board.devices[k].mode
