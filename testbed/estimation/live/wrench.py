"""Forces on the body and where they act: feet, weight, ropes, drill, as wrenches about the body's
origin. Compiled.

A wrench (6) is a force and its moment about the body's origin, body frame, N and N m.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from testbed.compiled import njit
from testbed.estimation.live.body_records import BodyBelief
from testbed.formats.arrays import Array
from testbed.machine.names import JOINTS, LEGS, ROTATION, SIDES
from testbed.recording.rows import DataRow
from testbed.robot.loads.foot_forces import LegNumbers, turn_z
from testbed.robot.model import write_rotation

X, Y, Z = 0, 1, 2
MOMENT = 3
"""Where the moment begins in a wrench."""
TURN, OUT, DOWN = 0, 1, 2
"""The joints of a leg: `q` (3) are its positions, rad, m, m."""


@njit
def gravity_in_body(attitude: Array, gravity: float, out: Array) -> None:
    """Gravity's vector (3) in the body frame, m/s2, at roll, pitch, yaw."""
    roll, pitch = attitude[0], attitude[1]
    out[X] = gravity * math.sin(pitch)
    out[Y] = -gravity * math.cos(pitch) * math.sin(roll)
    out[Z] = -gravity * math.cos(pitch) * math.cos(roll)


@njit
def turn_out_of_unit(vector: Array, roll: float, pitch: float) -> None:
    """A vector (3), in place, into the body frame from an inertial unit that is mounted Ry(pitch)
    Rx(roll).
    """
    if roll == 0.0 and pitch == 0.0:
        return
    x, y, z = vector[X], vector[Y], vector[Z]
    y, z = math.cos(roll) * y - math.sin(roll) * z, math.sin(roll) * y + math.cos(roll) * z
    vector[X] = math.cos(pitch) * x + math.sin(pitch) * z
    vector[Y] = y
    vector[Z] = math.cos(pitch) * z - math.sin(pitch) * x


@njit
def of_leg(values: Array, leg: int) -> Array:
    """A leg's three (a view) of twelve values in the order of AXES."""
    return values[ROTATION[leg] : ROTATION[leg] + len(JOINTS)]


@njit
def from_hip(leg: LegNumbers, centre: Array, turn: float, out: float) -> tuple[float, float]:
    """Where a point that is at `centre` (x, y) from the hip with all joints at 0 has gone, x and y
    from the hip, m: `out` along the radial joint, then turned by `turn`, rad.
    """
    x, y = centre[X] + leg.radial[X] * out, centre[Y] + leg.radial[Y] * out
    return turn_z(turn, x, y)


@njit
def leg_map(leg: LegNumbers, q: Array, arms: Array, out: Array) -> None:
    """Out (3, 3): change of the foot's force (body frame) by each cylinder's force, N/N, at joint
    positions q (3) with the cylinders' arms (3).
    """
    turning, sliding, lifting = arms[TURN], arms[OUT], arms[DOWN]
    radial_x, radial_y = turn_z(q[TURN], leg.radial[X], leg.radial[Y])
    foot_x, foot_y = from_hip(leg, leg.foot, q[TURN], q[OUT])
    reach = foot_x * radial_x + foot_y * radial_y
    aside = -foot_x * radial_y + foot_y * radial_x
    out[X, TURN], out[Y, TURN] = turning * radial_y / reach, -turning * radial_x / reach
    out[X, OUT] = sliding * (-radial_x + aside / reach * radial_y)
    out[Y, OUT] = sliding * (-radial_y - aside / reach * radial_x)
    out[X, DOWN], out[Y, DOWN] = 0.0, 0.0
    out[Z, TURN], out[Z, OUT], out[Z, DOWN] = 0.0, 0.0, lifting


@njit
def foot_point(leg: LegNumbers, q: Array, height: float, out: Array) -> None:
    """Underside of the foot in the body frame, m (3)."""
    x, y = from_hip(leg, leg.foot, q[TURN], q[OUT])
    out[X], out[Y], out[Z] = leg.hip[X] + x, leg.hip[Y] + y, height - q[DOWN]


@njit
def add_force(wrench: Array, force: Array, point: Array) -> None:
    """Wrench (6) += force (3) at point (3), about the body's origin."""
    for axis in range(3):
        wrench[axis] += force[axis]
    wrench[MOMENT + X] += point[Y] * force[Z] - point[Z] * force[Y]
    wrench[MOMENT + Y] += point[Z] * force[X] - point[X] * force[Z]
    wrench[MOMENT + Z] += point[X] * force[Y] - point[Y] * force[X]


class View(NamedTuple):
    """How the body is seen to lie and to accelerate: by the inertial unit, as it is believed to be
    turned on the body.
    """

    rotation: Array
    """Body to world (3, 3)."""
    gravity: Array
    """Body frame (3), m/s2."""
    specific_force: Array
    """Acceleration of the body's origin less gravity, body frame (3), m/s2."""


class Pulls(NamedTuple):
    """What the ropes do."""

    tension: Array
    """(2,) N."""
    direction: Array
    """(2, 3) towards the anchors, world frame."""


@njit
def view_of(
    attitude: Array, specific_force: Array, roll: float, pitch: float, gravity: float
) -> View:
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
def other_wrench(
    row: DataRow, view: View, turning: Array, pulls: Pulls, belief: BodyBelief
) -> Array:
    """Wrench (6) of weight, inertia, ropes and drill.

    row: posture, and what the drill's controls know. Body and inner links move with the view's
    specific force and the angular acceleration `turning` (3) rad/s2; frames and feet stand still
    and feel gravity alone.
    """
    wrench, force = np.zeros(6), np.empty(3)
    for axis in range(3):
        force[axis] = -belief.base_mass * view.specific_force[axis]
        for other in range(3):
            wrench[MOMENT + axis] -= belief.inertia[axis, other] * turning[other]
    add_force(wrench, force, belief.base_centre)
    for leg in range(len(LEGS)):
        add_links(wrench, belief.legs[leg], of_leg(row.position, leg), view)
    for rope in range(len(SIDES)):
        rope_direction(view, pulls.direction[rope], force)
        for axis in range(3):
            force[axis] *= pulls.tension[rope]
        add_force(wrench, force, belief.rope_point[rope])
    add_drill(wrench, row, view.gravity, belief)
    return wrench


@njit
def rope_direction(view: View, direction: Array, out: Array) -> None:
    """A rope's direction (3) of the world frame in the body frame."""
    for index in range(3):
        out[index] = 0.0
        for j in range(3):
            out[index] += view.rotation[j, index] * direction[j]


@njit
def add_links(wrench: Array, leg: LegNumbers, q: Array, view: View) -> None:
    """Wrench (6) += weight and inertia of a leg's three links at joint positions q (3)."""
    force, point = np.empty(3), np.empty(3)
    for joint in range(len(JOINTS)):
        link, stands_still = leg.links[joint], joint == DOWN
        x, y = from_hip(leg, link.centre, q[TURN], q[OUT] if joint >= OUT else 0.0)
        point[X], point[Y] = leg.hip[X] + x, leg.hip[Y] + y
        point[Z] = leg.hip[Z] + link.centre[Z] - (q[DOWN] if joint == DOWN else 0.0)
        for axis in range(3):
            pull = view.gravity[axis] if stands_still else -view.specific_force[axis]
            force[axis] = link.mass * pull
        add_force(wrench, force, point)


@njit
def add_drill(wrench: Array, row: DataRow, gravity: Array, belief: BodyBelief) -> None:
    """Wrench (6) += what the drill's controls know: thrust, torque, rods in the hole, mast and
    store.
    """
    force, point = np.zeros(3), np.empty(3)
    for index in range(3):
        point[index] = belief.drill_point[index]
    force[Z] = row.ordered_thrust + row.rods_in_hole * gravity[Z]
    add_force(wrench, force, point)
    wrench[MOMENT + Z] += row.ordered_torque
    point[Z] += row.rods_mast_height
    for index in range(3):
        force[index] = row.rods_in_mast * gravity[index]
    add_force(wrench, force, point)
    for index in range(3):
        force[index] = row.rods_stored * gravity[index]
    add_force(wrench, force, belief.store_point)
