"""How near a recorded run came to tipping or sliding: wrench and energy margin from its truth
(robot/stability.py).

Looked at twice a second at most. The standing feet, the ropes' pulls and the drill's reaction are
the true ones; the ropes keep their tension, the feet may share their load out as friction allows.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.formats.arrays import Array
from testbed.machine.model import Machine
from testbed.machine.names import AXES, GRAVITY_M_S2, LEGS, SIDES
from testbed.robot.attitude import rotations_of
from testbed.robot.loads.foot_loads import external_wrench, point_wrench
from testbed.robot.model import RobotModel
from testbed.robot.robot import Robot
from testbed.robot.stability import tipping_work_j, wrench_margin_n
from testbed.scenario.scenario import Scenario

Columns = Mapping[str, Array]
EVERY_S, MOST_LOOKS = 0.5, 240
SETTLED_S = 0.5
"""The first contacts of a run form within this time."""
HEADS = (
    "position_",
    "rods_stored",
    "contact_normal_",
    "body_pose_",
    "rope_force_",
    "drill_wrench_",
)
TOUCHING_N = 20.0
"""A foot of ROBOCLIMBER with more normal force than this stands: it can carry more."""


def stability_summary(
    scenario: Scenario, machine: Machine, data: Columns, truth: Columns
) -> dict[str, Any]:
    """Lowest wrench margin [N] and energy margin [J] of a run and their times; empty where columns
    are missing.
    """
    if f"position_{AXES[0]}" not in data or len(truth["t"]) < 2:
        return {}
    model = Robot.of(machine, scenario.carried_kg, scenario.ropes.attachment_height_m).model
    rows = min(len(data["t"]), len(truth["t"]))
    step = max(round(EVERY_S / float(np.median(np.diff(truth["t"])))), rows // MOST_LOOKS, 1)
    looks = np.arange(min(round(SETTLED_S / EVERY_S) * step, rows - 1), rows, step)
    data, truth = _at(looks, data), _at(looks, truth)
    normals = np.array([truth[f"contact_normal_{leg}"] for leg in LEGS])
    stands = machine.scale.force * TOUCHING_N <= normals.T
    friction = scenario.terrain.friction
    found = np.array(
        [
            _margins(model, friction, data, truth, look, np.flatnonzero(feet))
            for look, feet in enumerate(stands)
        ]
    )
    wrench, energy = (int(np.argmin(found[:, measure])) for measure in (0, 1))
    return {
        "lowest_wrench_margin_n": float(found[wrench, 0]),
        "lowest_wrench_margin_at_s": float(truth["t"][wrench]),
        "lowest_energy_margin_j": float(found[energy, 1]),
        "lowest_energy_margin_at_s": float(truth["t"][energy]),
    }


def _at(looks: NDArray[np.intp], series: Columns) -> Columns:
    """The columns that the margins need, at some rows."""
    return {name: series[name][looks] for name in series if name == "t" or name.startswith(HEADS)}


def _margins(
    model: RobotModel,
    friction: float,
    data: Columns,
    truth: Columns,
    row: int,
    standing: NDArray[np.intp],
) -> tuple[float, float]:
    """Wrench margin, N, and energy margin, J, at one row with these feet on the ground; all in the
    body frame.
    """
    joints = np.array([data[f"position_{axis}"][row] for axis in AXES])
    to_body = rotations_of([truth[f"body_pose_in_world_q{axis}"][row] for axis in "xyzw"]).T
    gravity = to_body @ np.array([0.0, 0.0, -GRAVITY_M_S2])
    feet = model.foot_positions_m(joints)
    pulls = (
        np.array(
            [[truth[f"rope_force_in_world_{side}_{axis}"][row] for axis in "xyz"] for side in SIDES]
        )
        @ to_body.T
    )
    drill = to_body @ np.array([truth[f"drill_wrench_in_world_f{axis}"][row] for axis in "xyz"])
    turn = to_body @ np.array([truth[f"drill_wrench_in_world_t{axis}"][row] for axis in "xyz"])
    load = external_wrench(
        model, joints, gravity, None, pulls, point_wrench(drill, model.drill_mount_m)
    )
    load[3:] += turn
    stored = float(data["rods_stored"][row]) * gravity if "rods_stored" in data else np.zeros(3)
    load += point_wrench(stored, model.rod_store_m)
    centre = model.centre_of_mass_m(joints)
    forces = np.vstack([model.total_mass_kg * gravity, pulls, drill, stored])
    points = np.vstack([centre, model.rope_attachments_m, model.drill_mount_m, model.rod_store_m])
    up = np.tile([0.0, 0.0, 1.0], (len(standing), 1))
    wrench = wrench_margin_n(feet[standing], up, friction, load, centre) if len(standing) else 0.0
    return wrench, tipping_work_j(feet[standing], forces, points)
