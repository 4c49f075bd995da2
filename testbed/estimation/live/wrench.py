"""Forces on the body and where they act: feet, weight, ropes, drill, as wrenches about the body's
origin. Compiled.

A wrench (6) is a force and its moment about the body's origin, body frame, N and N m.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from testbed.compiled import njit
from testbed.robot.loads import foot_forces as ff
from testbed.robot.model import write_rotation


@njit
def gravity_in_body(attitude: Any, gravity: float, out: Any) -> None:
    """Gravity's vector (3) in the body frame, m/s2, at roll, pitch, yaw."""
    roll, pitch = attitude[0], attitude[1]
    out[0] = gravity * math.sin(pitch)
    out[1] = -gravity * math.cos(pitch) * math.sin(roll)
    out[2] = -gravity * math.cos(pitch) * math.cos(roll)


@njit
def turn_out_of_unit(vector: Any, roll: float, pitch: float) -> None:
    """A vector (3), in place, into the body frame from an inertial unit that is mounted Ry(pitch)
    Rx(roll).
    """
    if roll == 0.0 and pitch == 0.0:
        return
    x, y, z = vector[0], vector[1], vector[2]
    y, z = math.cos(roll) * y - math.sin(roll) * z, math.sin(roll) * y + math.cos(roll) * z
    vector[0] = math.cos(pitch) * x + math.sin(pitch) * z
    vector[1] = y
    vector[2] = math.cos(pitch) * z - math.sin(pitch) * x


@njit
def leg_map(leg: Any, q: Any, arms: Any, out: Any) -> None:
    """Out (3, 3): change of the foot's force (body frame) by each cylinder's force, N/N, at joint
    positions q (3) with the cylinders' arms (3).
    """
    turning, sliding, lifting = arms[0], arms[1], arms[2]
    rx, ry = ff.turn_z(q[0], leg.radial[0], leg.radial[1])
    fx, fy = ff.turn_z(q[0], leg.foot[0] + leg.radial[0] * q[1], leg.foot[1] + leg.radial[1] * q[1])
    reach, aside = fx * rx + fy * ry, -fx * ry + fy * rx
    out[0, 0], out[1, 0], out[2, 0] = turning * ry / reach, -turning * rx / reach, 0.0
    out[0, 1] = sliding * (-rx + aside / reach * ry)
    out[1, 1] = sliding * (-ry - aside / reach * rx)
    out[0, 2], out[1, 2], out[2, 1], out[2, 2] = 0.0, 0.0, 0.0, lifting


@njit
def foot_point(leg: Any, q: Any, height: float, out: Any) -> None:
    """Underside of the foot in the body frame, m (3)."""
    x, y = ff.turn_z(q[0], leg.foot[0] + leg.radial[0] * q[1], leg.foot[1] + leg.radial[1] * q[1])
    out[0], out[1], out[2] = leg.hip[0] + x, leg.hip[1] + y, height - q[2]


@njit
def add_force(wrench: Any, force: Any, point: Any) -> None:
    """Wrench (6) += force (3) at point (3), about the body's origin."""
    for index in range(3):
        wrench[index] += force[index]
    wrench[3] += point[1] * force[2] - point[2] * force[1]
    wrench[4] += point[2] * force[0] - point[0] * force[2]
    wrench[5] += point[0] * force[1] - point[1] * force[0]


class View(NamedTuple):
    """How the body is seen to lie and to accelerate: by the inertial unit, as it is believed to be
    turned on the body.
    """

    rotation: Any
    """Body to world (3, 3)."""
    gravity: Any
    """Body frame (3), m/s2."""
    specific_force: Any
    """Acceleration of the body's origin less gravity, body frame (3), m/s2."""


@njit
def view_of(attitude: Any, specific_force: Any, roll: float, pitch: float, gravity: float) -> View:
    """What an inertial unit that is turned by roll and pitch shows of the body; attitude (3) and
    specific_force (3) are its readings.
    """
    turned, seen, down = np.empty(3), np.empty(3), np.empty(3)
    for index in range(3):
        turned[index], seen[index] = attitude[index], specific_force[index]
    turned[0] -= roll
    turned[1] -= pitch
    turn_out_of_unit(seen, roll, pitch)
    gravity_in_body(turned, gravity, down)
    rotation = np.empty((3, 3))
    write_rotation(turned, rotation)
    return View(rotation, down, seen)


@njit
def other_wrench(row: Any, view: View, turning: Any, tension: Any, body: Any) -> Any:
    """Wrench (6) of weight, inertia, ropes and drill.

    row: DataRow (posture, what the drill's controls know); tension (2) of the ropes, N. The view's
    specific force and `turning` (3) rad/s2 (angular acceleration) carry the body and the inner
    links; frames and feet stand still and carry gravity alone.
    """
    wrench, force = np.zeros(6), np.empty(3)
    for index in range(3):
        force[index] = -body.base_mass * view.specific_force[index]
        for j in range(3):
            wrench[3 + index] -= body.inertia[index, j] * turning[j]
    add_force(wrench, force, body.base_centre)
    for index in range(4):
        add_links(wrench, body.legs[index], row.position[3 * index : 3 * index + 3], view)
    for index in range(2):
        rope_direction(view, body.rope_direction[index], force)
        for j in range(3):
            force[j] *= tension[index]
        add_force(wrench, force, body.rope_point[index])
    add_drill(wrench, row, view.gravity, body)
    return wrench


@njit
def rope_direction(view: View, direction: Any, out: Any) -> None:
    """A rope's direction (3) of the world frame in the body frame."""
    for index in range(3):
        out[index] = 0.0
        for j in range(3):
            out[index] += view.rotation[j, index] * direction[j]


@njit
def add_links(wrench: Any, leg: Any, q: Any, view: View) -> None:
    """Wrench (6) += weight and inertia of a leg's three links at joint positions q (3)."""
    force, point = np.empty(3), np.empty(3)
    for index in range(3):
        link, out = leg.links[index], q[1] if index > 0 else 0.0
        x, y = ff.turn_z(
            q[0], link.centre[0] + leg.radial[0] * out, link.centre[1] + leg.radial[1] * out
        )
        point[0], point[1] = leg.hip[0] + x, leg.hip[1] + y
        point[2] = leg.hip[2] + link.centre[2] - (q[2] if index == 2 else 0.0)
        for j in range(3):
            pull = view.gravity[j] if index == 2 else -view.specific_force[j]
            force[j] = link.mass * pull
        add_force(wrench, force, point)


@njit
def add_drill(wrench: Any, row: Any, gravity: Any, body: Any) -> None:
    """Wrench (6) += what the drill's controls know: thrust, torque, rods in the hole, mast and
    store.
    """
    force, point = np.zeros(3), np.empty(3)
    for index in range(3):
        point[index] = body.drill_point[index]
    force[2] = row.ordered_thrust + row.rods_in_hole * gravity[2]
    add_force(wrench, force, point)
    wrench[5] += row.ordered_torque
    point[2] += row.rods_mast_height
    for index in range(3):
        force[index] = row.rods_in_mast * gravity[index]
    add_force(wrench, force, point)
    for index in range(3):
        force[index] = row.rods_stored * gravity[index]
    add_force(wrench, force, body.store_point)
