"""The run as a moving wireframe: what `animation.html.j2` draws, thinned to ten frames a second at most.

Everything is in a frame of the slope that stands still: x up the slope, y left, z off it, origin where the body began;
lengths in millimetres, forces in tens of newtons, as whole numbers: a minute of walking is some 60 kB.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from testbed.machine.model import Machine
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.robot.kinematics import LegKinematics
from testbed.robot.robot import Robot
from testbed.simulation.stability import rotation

if TYPE_CHECKING:
    from markupsafe import Markup

Array = npt.NDArray[np.float64]
Columns = Mapping[str, Array]
FRAME_S, MOST_FRAMES = 0.1, 400
MM, TEN_N = 1000.0, 0.1


def animation(data: Columns, truth: Columns, slope_deg: float, machine: Machine) -> Markup | None:
    """JSON for the page, with what means something in HTML escaped, or None where the recording lacks poses or positions.

    `machine`: the one that moved.

    Frames: time in ms; body origin (3) and its x and z axes (6, thousandths); feet (4, 3); ground's forces on them
    (4, 3); ropes' pulls (2, 3); thrust; hole depth.
    """
    from jinja2.utils import htmlsafe_json_dumps

    if (
        f"position_{AXES[0]}" not in data
        or "body_pose_in_world_x" not in truth
        or len(truth["t"]) < 2
    ):
        return None
    rows = min(len(data["t"]), len(truth["t"]))
    step = max(round(FRAME_S / float(np.median(np.diff(truth["t"])))), -(-rows // MOST_FRAMES), 1)
    robot = Robot.of(machine)
    legs, model = robot.legs, robot.model
    slope = np.radians(slope_deg)
    to_slope = np.array(
        [[np.cos(slope), 0, np.sin(slope)], [0, 1, 0], [-np.sin(slope), 0, np.cos(slope)]]
    )
    start = _vector(truth, "body_pose_in_world", 0)
    frames = [_frame(data, truth, k, legs, to_slope, start) for k in range(0, rows, step)]
    body, drill = machine.body, machine.drill_body
    return htmlsafe_json_dumps(
        {
            "slope": slope_deg,
            "ground": round(float(np.mean([_lowest(frame) for frame in frames[:1]]))),
            "box": _whole([*np.array(body.inertia_box_m) / 2.0], MM),
            "hips": _whole(legs.hips_m, MM),
            "sheaves": _whole(model.rope_attachments_m, MM),
            "mast": _whole([*model.drill_mount_m, drill.mast_length_m], MM),
            "frames": frames,
        },
        separators=(",", ":"),
    )


def _frame(
    data: Columns, truth: Columns, row: int, legs: LegKinematics, to_slope: Array, start: Array
) -> list[int]:
    origin = to_slope @ (_vector(truth, "body_pose_in_world", row) - start)
    turn = to_slope @ rotation(*(float(truth[f"body_pose_in_world_q{k}"][row]) for k in "xyzw"))
    feet = origin + legs.feet(np.array([data[f"position_{axis}"][row] for axis in AXES])) @ turn.T
    forces = (
        np.array([_vector(truth, f"foot_force_in_world_{leg}", row) for leg in LEGS]) @ to_slope.T
    )
    ropes = (
        np.array([_vector(truth, f"rope_force_in_world_{side}", row) for side in SIDES])
        @ to_slope.T
    )
    thrust = to_slope[2] @ np.array([truth[f"drill_wrench_in_world_f{k}"][row] for k in "xyz"])
    depth = float(truth["hole_depth"][row]) if "hole_depth" in truth else 0.0
    return [
        round(1000.0 * float(truth["t"][row])),
        *_whole(origin, MM),
        *_whole(turn[:, [0, 2]].T, MM),
        *_whole(feet, MM),
        *_whole(forces, TEN_N),
        *_whole(ropes, TEN_N),
        round(TEN_N * float(thrust)),
        round(MM * depth),
    ]


def _lowest(frame: list[int]) -> float:
    """Mean height of the feet in a frame: where the ground is drawn."""
    return float(np.mean(frame[12:22:3]))


def _vector(columns: Columns, name: str, row: int) -> Array:
    return np.array([columns[f"{name}_{k}"][row] for k in "xyz"])


def _whole(values: Any, factor: float) -> list[int]:
    scaled = np.nan_to_num(np.asarray(values, dtype=float).ravel() * factor)
    return [int(v) for v in np.rint(scaled)]
