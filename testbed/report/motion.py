"""A run's motion in the frame of its slope, thinned to as many moments as a page can carry.

The frame stands still: x up the slope, y left, z off it, through the world's origin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from testbed.estimation.contact_losses import loss_force_n
from testbed.formats.arrays import Array, Columns
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.robot.model import rotations_of
from testbed.robot.robot import Robot
from testbed.scenario.terrain import Terrain
from testbed.world.ground.terrain import make_ground

Rows = npt.NDArray[np.int64]
FRAME_S, MOST_FRAMES = 0.1, 400


@dataclass(frozen=True, eq=False)
class Motion:
    """n moments of a run: lengths in m, forces in N, all in the slope's frame."""

    time_s: Array
    """(n)"""
    origin_m: Array
    """(n, 3): the body's origin."""
    turn: Array
    """(n, 3, 3): rotation from the body to the slope."""
    feet_m: Array
    """(n, 4, 3): undersides of the feet, by the encoders."""
    foot_force_n: Array
    """(n, 4, 3): the ground on the feet."""
    normal_n: Array
    """(n, 4): its part along the ground's normal."""
    rope_force_n: Array
    """(n, 2, 3): the ropes on the body."""
    thrust_n: Array
    """(n): the drill on the body, off the slope."""
    hole_m: Array
    """(n): depth of the hole."""
    bears_n: float
    """A foot with at least this normal force carries."""


def frame_rows(truth: Columns) -> Rows:
    """Rows ten times a second, fewer where a run is so long that a page could not carry them."""
    rows = len(truth["t"])
    every_s = float(np.median(np.diff(truth["t"])))
    step = max(round(FRAME_S / every_s), -(-rows // MOST_FRAMES), 1)
    return np.arange(0, rows, step)


def recorded(data: Columns, truth: Columns) -> bool:
    """Whether a recording has what a motion is made of."""
    names = (f"position_{AXES[0]}", "body_pose_in_world_x")
    return names[0] in data and names[1] in truth and len(truth["t"]) > 1


def motion_at(data: Columns, truth: Columns, slope_deg: float, robot: Robot, rows: Rows) -> Motion:
    """The moments of these rows. `robot`: the one that moved."""
    slope = np.radians(slope_deg)
    up, off = np.cos(slope), np.sin(slope)
    to_slope = np.array([[up, 0, off], [0, 1, 0], [-off, 0, up]])

    def vectors(name: str) -> Array:
        """(n, 3) in the slope's frame."""
        in_world: Array = np.stack([truth[f"{name}{axis}"][rows] for axis in "xyz"], axis=1)
        return np.asarray(in_world @ to_slope.T)

    origin = vectors("body_pose_in_world_")
    quaternions = np.stack([truth[f"body_pose_in_world_q{axis}"][rows] for axis in "xyzw"], axis=1)
    turn = to_slope @ rotations_of(quaternions)
    joints = np.stack([data[f"position_{axis}"][rows] for axis in AXES], axis=1)
    feet_in_body = np.array([robot.legs.feet(row) for row in joints])
    nothing = np.zeros(len(rows))
    return Motion(
        time_s=truth["t"][rows],
        origin_m=origin,
        turn=turn,
        feet_m=origin[:, None] + np.einsum("nij,nkj->nki", turn, feet_in_body),
        foot_force_n=np.stack([vectors(f"foot_force_in_world_{leg}_") for leg in LEGS], axis=1),
        normal_n=np.stack([truth[f"contact_normal_{leg}"][rows] for leg in LEGS], axis=1),
        rope_force_n=np.stack([vectors(f"rope_force_in_world_{side}_") for side in SIDES], axis=1),
        thrust_n=vectors("drill_wrench_in_world_f")[:, 2],
        hole_m=truth["hole_depth"][rows] if "hole_depth" in truth else nothing,
        bears_n=loss_force_n(robot.machine.scale.nominal_load_n),
    )


def footholds(motion: Motion, leg: int) -> Array:
    """Where a foot stood (k, 2), m: the middle of each stretch of time in which it carried."""
    carries = motion.normal_n[:, leg] >= motion.bears_n
    edges = np.flatnonzero(np.diff(np.concatenate([[False], carries, [False]]).astype(int)))
    spans = edges.reshape(-1, 2)
    return np.array(
        [motion.feet_m[start:stop, leg, :2].mean(axis=0) for start, stop in spans]
    ).reshape(-1, 2)


def support(motion: Motion, moment: int) -> tuple[Array, Array]:
    """The feet that carry, in order around the robot (k, 2), and where their load acts (2); m, in
    the slope's plane.
    """
    around = [LEGS.index(leg) for leg in ("fl", "fr", "rr", "rl")]
    normal = motion.normal_n[moment].clip(min=0.0)
    places = motion.feet_m[moment, :, :2]
    corners = [foot for foot in around if normal[foot] >= motion.bears_n]
    total = float(normal.sum())
    middle = normal @ places / total if total > 0.0 else places.mean(axis=0)
    return places[corners], middle


# The ground around a run's path as heights on a grid: what the moving picture and the plan view
# draw.

CELL_M, ROOM_M, MOST_CELLS = 0.2, 1.6, 60


class Heights(NamedTuple):
    """Heights off the mean slope, m, at x0 + i cell, y0 + j cell of the slope's frame."""

    x0_m: float
    y0_m: float
    cell_m: float
    values_m: Array
    """(rows along x, columns along y)"""


def heights_around(terrain: Terrain | None, path_m: Array) -> Heights | None:
    """The ground with some room around the points (n, 2) that were stepped on; None where it is a
    plane.
    """
    if terrain is None:
        return None
    ground = make_ground(terrain)
    if ground.flat:
        return None
    low, high = path_m.min(axis=0) - ROOM_M, path_m.max(axis=0) + ROOM_M
    cell = max(CELL_M, float((high - low).max()) / MOST_CELLS)
    counts = np.ceil((high - low) / cell).astype(int) + 1
    x, y = (low[side] + cell * np.arange(counts[side]) for side in (0, 1))
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    values, _ = ground.surface(points)
    return Heights(float(low[0]), float(low[1]), cell, values.reshape(len(x), len(y)))
