"""Where a run begins: the robot on its ground in static equilibrium, ropes pulling, nothing
moving.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from testbed.effects.terms import Hidden
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.machine.model import Machine
from testbed.machine.names import AXES, GRAVITY_M_S2, LEGS, VERTICAL
from testbed.robot.loads.foot_loads import ExpectedLoads, rods_wrench
from testbed.robot.model import RobotModel
from testbed.robot.rope_bearings import SurveyedRopes
from testbed.scenario.parts import Robot
from testbed.scenario.scenario import Scenario
from testbed.world.engine import Engine
from testbed.world.ground.footing import Footing, footing_of
from testbed.world.ground.terrain import Ground, anchors_in_world
from testbed.world.undeclared import anchors_of, attachments_of

TRIES, TOUCH_M = 40, 1.0e-6
"""What touches the ground at the start touches it to within this distance."""

ROUNDING = 1e-9
"""Joint positions that are out of range by less are at its end, m and rad."""

RAISED_M = 0.05
"""Mean extension of the vertical cylinders from which on the robot starts on its feet, not on its
belly.
"""

TAUT_SHARE = 0.05
"""A rope that has nothing to do is kept taut by this share of the other's tension (E)."""


@dataclass(frozen=True)
class Start:
    """World frame; joints (12), joint forces that hold the posture (12, N and N m), ropes left,
    right.
    """

    position_m: Array
    rotation: Array
    joints: Array
    joint_forces: Array
    foot_forces_in_body: Array
    anchors_m: Array
    rope_directions: Array
    surveyed_anchors_m: Array
    """Where people believe the anchors to be; the directions that this gives."""
    surveyed_directions: Array
    surveyed_distances_m: Array
    """(2,) of these anchors from where the ropes are attached."""
    rope_tension_n: Array
    raised: bool
    """Whether it stands on its feet; else it may lie on its belly."""
    footing: Footing | None

    @property
    def surveyed_ropes(self) -> SurveyedRopes:
        """The ropes as people believe them to lead, world frame."""
        return SurveyedRopes(self.surveyed_directions, self.surveyed_distances_m)


def nominal_joints(scenario: Scenario) -> Array:
    """(12): the scenario's posture in AXES order, rad and m."""
    r = scenario.robot
    joints = np.zeros(12)
    joints[0::3] = np.radians(r.rotation_deg)
    joints[1::3] = r.radial_m
    joints[2::3] = r.vertical_m
    return joints


def find_start(
    scenario: Scenario,
    ground: Ground,
    model: RobotModel,
    engine: Engine,
    parameters: Machine,
    drill_known: Any,
    hidden: Hidden,
) -> Start:
    """Place the body parallel to the mean slope, reach the ground with each foot, balance ropes,
    feet and joints.

    Where it lies on its belly, the feet are off the ground as far as they are drawn in.

    Raises InputError where a posture or a foothold is out of a joint's range, or a robot on its
    feet has another part in the ground.
    """
    rotation = ground.rotation_slope_to_world
    raised = float(np.mean(scenario.robot.vertical_m)) > RAISED_M * parameters.scale.length
    position, joints, lift_m = _put_down(scenario, ground, model, engine, raised)
    undersides = position + model.foot_positions_m(joints) @ rotation.T
    footing = footing_of(scenario.terrain, ground, engine, undersides, tuple(hidden.feet.values()))
    surveyed = anchors_in_world(scenario.ropes, rotation)
    drawn = position + model.rope_attachments_m @ rotation.T
    points = position + attachments_of(hidden, model.rope_attachments_m) @ rotation.T
    anchors = anchors_of(hidden, surveyed, points, rotation)
    directions = _towards(anchors, points)
    gravity = rotation.T @ np.array([0.0, 0.0, -GRAVITY_M_S2])
    tension = _tensions(scenario, model, gravity, directions @ rotation)
    loads = ExpectedLoads(
        model,
        parameters,
        friction=ground.friction,
        ground_compliance_m_n=1.0 / ground.stiffness_n_m,
    ).solve(
        joints,
        gravity,
        rope_forces_in_body=tension[:, None] * (directions @ rotation),
        drill_wrench_in_body=rods_wrench(model, drill_known, gravity),
    )
    forces = loads.force_in_body_n * (lift_m == 0.0)
    _, jacobians = model.feet(joints)
    hold = model.gravity_forces(joints, gravity)[6:] - np.einsum("lij,li->j", jacobians, forces)
    # Press each foot in as deep as the ground gives under its load.
    if scenario.robot.height_offset_m == 0.0:
        joints[list(VERTICAL)] += np.maximum(forces[:, 2], 0.0) / (
            ground.stiffness_n_m if footing is None else footing.stiffness_n_m
        )
    return Start(
        position_m=position,
        rotation=rotation,
        joints=joints,
        joint_forces=hold,
        foot_forces_in_body=forces,
        anchors_m=anchors,
        rope_directions=directions,
        surveyed_anchors_m=surveyed,
        surveyed_directions=_towards(surveyed, drawn),
        surveyed_distances_m=np.linalg.norm(surveyed - drawn, axis=1),
        rope_tension_n=tension,
        raised=raised,
        footing=footing,
    )


def _towards(ends_m: Array, points_m: Array) -> Array:
    """Unit vectors (n, 3) from points to ends."""
    chords = ends_m - points_m
    return np.asarray(chords / np.linalg.norm(chords, axis=1)[:, None])


def _tensions(
    scenario: Scenario, model: RobotModel, gravity: Array, directions_in_body: Array
) -> Array:
    """Rope tensions (2) at the start, N: as given, or equal ones that carry `share` of the weight
    along the slope.
    """
    r = scenario.ropes
    if not r.enabled:
        return np.zeros(2)
    if r.tension_n is not None:
        return np.array(r.tension_n)
    shares = np.ones(2) if r.pull == "equal" else straight_shares(directions_in_body)
    along = -gravity[0] * model.total_mass_kg
    largest_n = max(r.share * along / float(shares @ directions_in_body[:, 0]), 0.0)
    return np.asarray(largest_n * shares)


def straight_shares(directions: Array) -> Array:
    """How two ropes along `directions` (2, 3), body frame, share a pull that leads as little aside
    as it can: (2,), the larger 1. None goes slack.
    """
    left = directions[:, 1]
    aside = np.abs(left / directions[:, 0])
    shares = np.abs(left[::-1]) if left[0] * left[1] < 0.0 else 1.0 * (aside == aside.min())
    return np.asarray(np.maximum(shares / shares.max(), TAUT_SHARE))


def _reach_down(engine: Engine, position: Array, rotation: Array, q: Array) -> None:
    """Lengthen the vertical joints `q` (12), in place, until each foot just touches its ground
    (which may be uneven).

    Raises InputError where there is no ground.
    """
    for _ in range(TRIES):
        engine.reset(position, rotation, q)
        gaps_m, ways_m = _gaps(engine, rotation)
        q[list(VERTICAL)] += ways_m
        if np.abs(gaps_m).max() < TOUCH_M:
            return


def _gaps(engine: Engine, rotation: Array) -> tuple[Array, Array]:
    """Distance of each foot from its ground (4), m, negative inside it, and its way down the mean
    slope's normal to there (4), m: the distance over the cosine of the ground's tilt.

    Raises InputError where there is no ground.
    """
    gaps_m, ways_m = np.zeros(len(LEGS)), np.zeros(len(LEGS))
    for leg, name in enumerate(LEGS):
        gap_m, towards_foot = engine.feet.gap(leg)
        if not math.isfinite(gap_m):
            raise InputError(
                "the start posture stands beside the ground", field=f"robot foot {name}"
            )
        gaps_m[leg] = gap_m
        ways_m[leg] = gap_m / max(float(towards_foot @ rotation[:, 2]), 0.3)
    return gaps_m, ways_m


def _touching_height(ground: Ground, engine: Engine, model: RobotModel, joints: Array) -> float:
    """Height of the body's origin above the mean slope at which the foot that is nearest to its
    ground just touches it, with joints (12) as they are, m.
    """
    rotation = ground.rotation_slope_to_world
    height_m = -float(model.foot_positions_m(joints)[:, 2].min())
    if ground.flat:
        return height_m
    for _ in range(TRIES):
        engine.reset(height_m * rotation[:, 2], rotation, joints)
        way_m = float(_gaps(engine, rotation)[1].min())
        height_m -= way_m
        if abs(way_m) < TOUCH_M:
            break
    return height_m


def _put_down(
    scenario: Scenario, ground: Ground, model: RobotModel, engine: Engine, raised: bool
) -> tuple[Array, Array, float]:
    """Place of the body in the world (3), m, joints (12), and how far other parts than feet lift
    the feet off the ground, m. Where feet are too uneven to reach it from where the robot lies, all
    legs are as drawn in as the scenario says.
    """
    rotation, robot = ground.rotation_slope_to_world, scenario.robot
    joints = nominal_joints(scenario)
    _check_range(joints, model, "robot")
    reached = joints.copy()
    if robot.height_offset_m > 0.0:
        height = _touching_height(ground, engine, model, joints) + robot.height_offset_m
        position = rotation @ np.array([0.0, 0.0, height])
    else:
        feet = model.foot_positions_m(joints)
        height = -float(feet[:, 2].mean())
        position = rotation @ np.array([0.0, 0.0, height])
        if ground.flat:
            gaps = height + feet[:, 2]
        else:
            _reach_down(engine, position, rotation, reached)
            gaps = (reached - joints)[list(VERTICAL)]
        shift = float(gaps.max() + gaps.min()) / 2.0
        reached = joints.copy()
        reached[list(VERTICAL)] += gaps - shift
        if not raised and _out_of_range(reached, model) is not None:
            lying = position - float(gaps.min()) * rotation[:, 2]
            lift_m = _lift_out(engine, lying, rotation, joints)
            if lift_m > 0.0:
                return lying + lift_m * rotation[:, 2], joints, lift_m
        _refuse_lengths_that_vanish(robot)
        _check_range(reached, model, "terrain")
        position = position - shift * rotation[:, 2]
    lift_m = _lift_out(engine, position, rotation, reached, scenario if raised else None)
    return position + lift_m * rotation[:, 2], reached, lift_m


def _refuse_lengths_that_vanish(robot: Robot) -> None:
    """Raise InputError where legs that reach for their ground are given lengths of their own."""
    if len(set(robot.vertical_m)) > 1:
        raise InputError(
            "legs on the ground reach for it, and of lengths of their own nothing is left",
            field="robot.vertical_m",
            value=list(robot.vertical_m),
            allowed="one length for all, or robot.height_offset_m above 0, from where each leg "
            "comes down as long as it is",
        )


def _lift_out(
    engine: Engine,
    position: Array,
    rotation: Array,
    joints: Array,
    on_its_feet: Scenario | None = None,
) -> float:
    """How far along the slope's normal the robot has to go until only feet are in the ground, m.

    Raises InputError where one that stands `on_its_feet`, as this scenario has it, would have to.
    """
    lift_m = 0.0
    for _ in range(TRIES):
        engine.reset(position + lift_m * rotation[:, 2], rotation, joints)
        gap_m, link = engine.feet.elsewhere(engine.ground)
        if gap_m >= -TOUCH_M:
            break
        if on_its_feet is not None:
            mean_m = float(np.mean(on_its_feet.robot.vertical_m))
            raise InputError(
                f"the <collision> of {engine.link_names[link]} lies {-1e3 * gap_m:.3g} mm in the "
                "ground at the start",
                field="robot.vertical_m",
                value=round(mean_m, 4),
                allowed=f"at least {mean_m - gap_m:.4g} m, as the mean of the legs",
            )
        lift_m -= gap_m
    return lift_m


def _out_of_range(joints: Array, model: RobotModel) -> int | None:
    """The first of joints (12) that is out of its range."""
    low, high = model.limits.T
    out = np.flatnonzero((joints < low - ROUNDING) | (joints > high + ROUNDING))
    return int(out[0]) if len(out) else None


def _check_range(joints: Array, model: RobotModel, section: str) -> None:
    index = _out_of_range(joints, model)
    if index is not None:
        low, high = model.limits[index]
        raise InputError(
            "the start posture is out of the joint's range"
            if section == "robot"
            else "a foot cannot reach the ground within its stroke",
            field=f"{section} {AXES[index]}",
            value=round(float(joints[index]), 4),
            allowed=f"{low:.4g} to {high:.4g}",
        )
