"""The 18 equations of motion of the measured robot: what its six balances of the body and its
swinging feet miss.

Twelve of the equations are the joints': cylinder force less friction through the linkage, less what
weight and inertia of the frames ask for (Pinocchio's inverse dynamics), is what the ground does to
the foot. Six are the body's: feet, ropes and drill must carry weight and inertia. A foot in the air
carries nothing: its three forces must vanish.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot import friction
from testbed.diagnosis.robot.bins import Bins
from testbed.diagnosis.robot.oil import Oil
from testbed.diagnosis.robot.rope_directions import rope_ways
from testbed.diagnosis.robot.rope_stiffness import HeldRopes
from testbed.diagnosis.robot.supply import Supply
from testbed.effects.signature import RobotSeen
from testbed.machine.model import Machine
from testbed.machine.names import AXES, LEGS
from testbed.machine.scale import Scale
from testbed.robot.loads.foot_loads import known_wrench
from testbed.robot.model import rotation_from_attitude
from testbed.robot.robot import Robot

Array = npt.NDArray[np.float64]
JOINTS_A_LEG, BODY_ROWS = 3, 6
MOST, HARDLY = 0.5, 0.01
"""Shares of a bin in which control means a foot to carry."""
LIFTED_M = 0.02
"""A foot that control does not mean to carry and that is drawn up by so much hangs in the air."""
BELLY_CLEAR_M = 0.05
"""A belly that is nearer to the ground between the feet may touch it (E)."""


@dataclass(frozen=True, eq=False)
class BodyBalance:
    """What the believed balances miss in each of n bins, and what a cylinder's force does to it."""

    seen: RobotSeen
    missing: Array
    """(n, 18) wrench on the body (6), N and N m about its origin, then forces of the four feet (12)
    where they hang in the air, N; 0 where they stand.
    """
    by_force: Array
    """(n, 18, 12) the same by each cylinder's force."""
    counted: npt.NDArray[np.bool_]
    """(n, 18) whether there is such an equation in this bin."""
    foot_force: Array
    """(n, 4, 3) ground on foot, body frame, as believed."""
    spread_n: Array
    """(n, 12) half width of the set in which friction lies at rest, 0 while sliding."""

    def part(self, bins: npt.NDArray[np.intp]) -> BodyBalance:
        """The same of some of the bins, by their indices."""
        seen = replace(self.seen, **_rows_of_bins(self.seen, self.seen.bins, bins))
        return replace(self, seen=seen, **_rows_of_bins(self, self.seen.bins, bins))


def _rows_of_bins(
    whole: RobotSeen | BodyBalance, count: int, bins: npt.NDArray[np.intp]
) -> dict[str, Any]:
    """Rows `bins` of every array of a dataclass whose first axis are its `count` bins."""
    arrays = {f.name: getattr(whole, f.name) for f in fields(whole)}
    return {
        name: values[bins]
        for name, values in arrays.items()
        if isinstance(values, np.ndarray) and values.ndim and len(values) == count
    }


def balance_of(
    bins: Bins,
    other: OtherSigns,
    robot: Robot,
    ropes_in_world: Array,
    beside: Mapping[int, Array] | None = None,
) -> BodyBalance:
    """Hold the measured bins against the believed machine; `ropes_in_world` (2, 3) as surveyed.

    `beside`: cylinder -> (n,) N by which its force is thought to be less than its pressures say.
    Everything is then as with these forces, and what they make is still missed: the same straight
    lines, drawn where the machine is thought to be.
    """
    machine, n = robot.machine, bins.count
    coulomb, viscous, spread = friction.friction(bins, machine)
    area_a, area_b = friction.areas(machine)
    less = _by_cylinder(n, beside or {})
    piston = friction.pistons_n(bins, robot) - less
    rotation = np.array([rotation_from_attitude(rpy) for rpy in bins.attitude_rad])
    rope_way = rope_ways(bins, robot, ropes_in_world, rotation)
    hangs = hanging(bins, machine.scale)
    stands = ~np.repeat(hangs, JOINTS_A_LEG, axis=1)  # a foot in the air pushes across no rod
    side, growing = friction.friction_across(bins, robot, stands)
    sense = friction.sense_of_friction(bins.direction)
    side_load = np.zeros((n, len(AXES)))
    for _ in range(PASSES):  # friction by side load asks for foot forces, and these for friction
        force = piston - (sense * coulomb + side * side_load) - viscous
        measured = Measured(bins, force, side, growing, hangs, rope_way)
        found = [of_bin(robot, measured, k, bins.joint[k]) for k in range(n)]
        foot_force = np.array([one.foot_force for one in found])
        side_load = stands * _side_loads(foot_force)
    masses = [robot.model.asked_by_masses(q, -f) for q, f in _each(bins)]
    frames = _slope_frames(rotation, bins)
    seen = RobotSeen(
        time_s=bins.time_s,
        extension_m=bins.extension_m,
        joint=bins.joint,
        speed_m_s=bins.speed_m_s,
        acceleration_m_s2=bins.acceleration_m_s2,
        direction=bins.direction,
        arm_m=bins.arm_m,
        pressure_a_pa=bins.pressure_a_pa,
        pressure_b_pa=bins.pressure_b_pa,
        pressure_a_rate=bins.pressure_a_rate,
        pressure_b_rate=bins.pressure_b_rate,
        pressure_range_pa=np.array([a.sensor.pressure_range_pa for a in machine.axes.values()]),
        area_a_m2=area_a,
        area_b_m2=area_b,
        stroke_m=robot.linkages.stroke_m,
        coulomb_n=coulomb,
        dry_n=coulomb + friction.by_force_across(bins, robot) * side_load,
        sense=sense,
        viscous_n=viscous,
        load_n=np.array([one.load for one in found]),
        side_load_n=side_load,
        oil_degc=bins.oil_degc,
        supply_pa=bins.supply_pa,
        command=bins.command,
        gravity=-bins.specific_force,
        attitude_rad=bins.attitude_rad,
        tension_n=bins.tension_n,
        rope_way=rope_way,
        rope_point_m=robot.model.rope_attachments_m,
        slope_frame=frames,
        drill_point_m=robot.model.drill_mount_m,
        thrust_n=bins.drill["ordered_thrust"],
        body_mass_kg=machine.body.mass_kg,
        foot_m=np.array([one.feet for one in found]),
        foot_by_joint=np.array([one.jacobians for one in found]),
        asked_by_link=np.array([links for links, _ in masses]),
        asked_by_moment=np.array([moments for _, moments in masses]),
        asked_by_gravity=np.array([robot.model.asked_by_lift(q) for q, _ in _each(bins)]),
        missing_by_joint=_by_joint(robot, measured),
        friction_use=_use(foot_force, frames, machine.scale),
        **other.seen(),
    )
    counted = _counted(hangs, _lies(machine, frames, seen.foot_m))
    missing, by_force = (np.array([getattr(one, name) for one in found]) for name in ROWS)
    missing += np.einsum("nri,ni->nr", by_force, less)
    return BodyBalance(seen, missing, by_force, counted, foot_force, spread)


def _counted(hangs: npt.NDArray[np.bool_], lies: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """(n, 18) equations that count: the body's unless it lies (n,), of feet that hang (n, 4)."""
    of_body = np.repeat(~lies[:, None], BODY_ROWS, axis=1)
    return np.hstack([of_body, np.repeat(hangs, JOINTS_A_LEG, axis=1)])


def _by_cylinder(bins: int, forces_n: Mapping[int, Array]) -> Array:
    """Forces of some cylinders as those of all (n, 12), N."""
    out = np.zeros((bins, len(AXES)))
    for at, force_n in forces_n.items():
        out[:, at] = force_n
    return out


@dataclass(frozen=True, eq=False)
class OtherSigns:
    """What effects look at beside the equations of motion: oil, supply, lines of the piston forces
    (12,), held ropes.
    """

    oils: Sequence[Oil]
    supply: Supply
    line_hz: Array
    line_n: Array
    """Amplitude of what is surely a line, else 0."""
    ropes: HeldRopes = field(default_factory=HeldRopes.none)

    def seen(self) -> dict[str, Any]:
        """By field of RobotSeen; of oil (n, 12)."""
        of_oil = {
            "oil_by_leak": "by_leak",
            "oil_by_deadband": "by_wide_deadband",
            "oil_by_air": "by_air",
            "oil_by_hose": "by_hose",
            "oil_by_reading": "by_wrong_reading",
            "oil_by_lateness": "by_lateness",
        }
        return {
            **{
                name: np.stack([getattr(oil, column) for oil in self.oils], axis=1)
                for name, column in of_oil.items()
            },
            "supply_by_pressure": self.supply.by_pressure,
            "supply_by_flow": self.supply.by_flow,
            "supply_by_droop": self.supply.by_droop,
            "shows_ropes": self.ropes.shown,
            "line_hz": self.line_hz,
            "line_n": self.line_n,
        }


ROWS = ("missing", "by_force")
PASSES = 3


def _side_loads(foot_force: Array) -> Array:
    """(n, 12) force across each rod: a vertical frame takes the foot's force along the slope, a
    radial one its load.
    """
    out = np.zeros((len(foot_force), len(LEGS), JOINTS_A_LEG))
    out[:, :, 1] = np.abs(foot_force[:, :, 2])
    out[:, :, 2] = np.linalg.norm(foot_force[:, :, :2], axis=2)
    return out.reshape(len(foot_force), -1)


@dataclass(frozen=True, eq=False)
class Measured:
    """What a bin's balance is made of beside its posture."""

    bins: Bins
    force_n: Array
    """(n, 12) of the pistons less friction."""
    side_friction: Array
    """(n, 12) believed friction by a newton across the rod, with its sign; `side_growing`: what it
    grows by with a metre or radian of its joint.
    """
    side_growing: Array
    hangs: npt.NDArray[np.bool_]
    """(n, 4) feet in the air."""
    rope_way: Array


@dataclass(frozen=True, eq=False)
class OfBin:
    """The balances of one bin; fields as in BodyBalance and RobotSeen, without their first axis."""

    missing: Array
    by_force: Array
    foot_force: Array
    feet: Array
    jacobians: Array
    load: Array


def of_bin(robot: Robot, measured: Measured, k: int, joint: Array) -> OfBin:
    """Bin k, were the encoders at `joint` (12)."""
    bins = measured.bins
    lift = bins.specific_force[k]
    arm = robot.linkages.rods(joint)[1]
    change = np.concatenate([np.zeros(3), bins.turning[k], bins.joint_acceleration[k]])
    speed = np.concatenate([np.zeros(6), bins.joint_rate[k]])
    # The unit's specific force is acceleration less gravity in one: gravity against it, the origin
    # without acceleration.
    asked = robot.model.inverse_dynamics(joint, speed, change, -lift)
    feet, whole = robot.model.feet(joint)
    free = measured.force_n[k] * arm - asked[6:]
    missing, by_force = np.zeros(18), np.zeros((18, 12))
    foot_force, jacobians = np.empty((4, 3)), np.empty((4, 3, 3))
    missing[:6] = -asked[:6]
    for leg in range(len(LEGS)):
        own = slice(JOINTS_A_LEG * leg, JOINTS_A_LEG * (leg + 1))
        jacobians[leg] = whole[leg][:, own]
        back = -np.linalg.inv(jacobians[leg].T)
        force = back @ free[own]
        foot_force[leg] = force
        # A force that is off asks for another friction by side load, which is off by that in turn.
        answers = measured.side_friction[k, own, None] * _side_slopes(force)
        by = np.linalg.solve(np.eye(3) + (back * arm[own]) @ answers, back * arm[own])
        if measured.hangs[k, leg]:
            rows = slice(6 + own.start, 6 + own.stop)
            missing[rows], by_force[rows, own] = force, by
        else:
            missing[:3] += force
            arm_of_foot = _moment_arm(feet[leg])
            missing[3:6] += arm_of_foot @ force
            by_force[:3, own] = by
            by_force[3:6, own] = arm_of_foot @ by
    for side, way in enumerate(measured.rope_way[k]):
        pull = bins.tension_n[k, side] * way
        missing[:3] += pull
        missing[3:6] += _moment_arm(robot.model.rope_attachments_m[side]) @ pull
    drill = {name: values[k] for name, values in bins.drill.items()}
    missing[:6] += known_wrench(robot.model, drill, -lift)
    return OfBin(missing, by_force, foot_force, feet, jacobians, free / arm)


def _moment_arm(point: Array) -> Array:
    """(3, 3) moment about the origin by a force at a point (3)."""
    x, y, z = point.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _side_slopes(force: Array) -> Array:
    """(3, 3) change of the force across a leg's rods (rotation, radial, vertical) by its foot's
    force (3).
    """
    level = max(float(np.hypot(force[0], force[1])), 1.0)
    return np.array(
        [[0.0, 0.0, 0.0], [0.0, 0.0, np.sign(force[2])], [force[0] / level, force[1] / level, 0.0]]
    )


def _each(bins: Bins) -> Iterator[tuple[Array, Array]]:
    return zip(bins.joint, bins.specific_force, strict=True)


def _by_joint(robot: Robot, measured: Measured) -> Array:
    """(n, 18, 12) by differences in some bins, straight lines between them: postures change
    slowly.
    """
    n = measured.bins.count
    some = np.unique(np.concatenate([np.arange(0, n, EVERY), [n - 1]]))
    out = np.empty((len(some), 18, len(AXES)))
    for row, k in enumerate(some):
        joint = measured.bins.joint[k]
        at = of_bin(robot, measured, k, joint)
        growing = measured.side_growing[k] * _side_loads(at.foot_force[None])[0]
        for i in range(len(AXES)):
            moved = joint.copy()
            moved[i] -= STEP
            there = of_bin(robot, measured, k, moved)
            felt = [
                _side_slopes(force) @ change
                for force, change in zip(
                    at.foot_force, at.foot_force - there.foot_force, strict=True
                )
            ]
            friction = measured.side_friction[k] * np.concatenate(felt)
            friction[i] += growing[i] * STEP
            out[row, :, i] = (at.missing - there.missing - at.by_force @ friction) / STEP
    index = np.arange(n)
    flat = out.reshape(len(some), -1)
    lines = [np.interp(index, some, column) for column in flat.T]
    return np.column_stack(lines).reshape(n, 18, len(AXES))


EVERY = 10
STEP = 1e-4
"""m or rad."""


def hanging(bins: Bins, scale: Scale) -> npt.NDArray[np.bool_]:
    """(n, 4) whether a foot hangs in the air: not meant to carry all along, and drawn up off where
    it stood.
    """
    height, lifted_m = bins.extension_m[:, 2::3], scale.length * LIFTED_M
    out = np.zeros((bins.count, len(LEGS)), dtype=bool)
    for leg in range(len(LEGS)):
        stands = bins.carrying[:, leg] > MOST
        if stands.any() and not stands.all():
            index = np.arange(bins.count)
            last = np.interp(index, index[stands], height[stands, leg])
            out[:, leg] = (bins.carrying[:, leg] < HARDLY) & (last - height[:, leg] > lifted_m)
    return out


def _lies(machine: Machine, frames: Array, foot_m: Array) -> npt.NDArray[np.bool_]:
    """(n,) whether the belly is so low between the feet (n, 4, 3) that it may rest on the ground,
    which then carries what no sensor reads.
    """
    body = machine.body
    length, width = 0.5 * body.belly_box_m[0], 0.5 * body.belly_box_m[1]
    corners = np.array(
        [(x, y, body.belly_height_m) for x in (-length, length) for y in (-width, width)]
    )
    off_slope = frames[:, 2]
    ground = np.einsum("nj,nlj->nl", off_slope, foot_m).mean(axis=1)
    return np.asarray(
        (off_slope @ corners.T).min(axis=1) - ground < machine.scale.length * BELLY_CLEAR_M
    )


def _slope_frames(rotation: Array, bins: Bins) -> Array:
    """(n, 3, 3) rows: x up the slope, y to the left, z off it, in the body frame: the slope on
    which it stood first.
    """
    pitch = float(np.median(bins.attitude_rad[:10, 1]))
    slope = rotation_from_attitude(np.array([0.0, pitch, 0.0]))
    return np.asarray(np.einsum("ji,njk->nik", slope, rotation))


def _use(foot_force: Array, frames: Array, scale: Scale) -> Array:
    """(n, 4) force along the slope over force off it."""
    force = np.einsum("nij,nlj->nli", frames, foot_force)
    along = np.linalg.norm(force[:, :, :2], axis=2)
    return np.asarray(along / np.maximum(np.abs(force[:, :, 2]), scale.times("N") * LEAST_LOAD_N))


LEAST_LOAD_N = 300.0
