"""The run as a moving wireframe: what `animation.html.j2` draws of a run, and the page of one on
its way.

Lengths go in millimetres from where the body began, forces in tens of newtons (as much less as the
machine is lighter than ROBOCLIMBER), as whole numbers: a minute of walking is some 60 kB.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from testbed.formats.arrays import Array, Columns
from testbed.machine.names import LEGS, SIDES
from testbed.machine.urdf_check import lacking
from testbed.report.motion import Heights, Motion, heights_around, motion_at
from testbed.report.page import policy, render, script
from testbed.robot.robot import Robot
from testbed.scenario.scenario import Scenario
from testbed.simulation.metrics import rope_tension_n

if TYPE_CHECKING:
    from markupsafe import Markup

MM, TEN_N = 1000.0, 0.1


def animation(
    motion: Motion, slope_deg: float, robot: Robot, ground: Heights | None = None
) -> Markup:
    """JSON for the page, with what means something in HTML escaped. `robot`: the one that moved.

    Frames: time in ms; body origin (3) and its x and z axes (6, thousandths); feet (4, 3); ground's
    forces on them (4, 3); ropes' pulls (2, 3); thrust; hole depth. The ground is one height where
    it is a plane, else a grid.
    """
    from jinja2.utils import htmlsafe_json_dumps

    contents = scene(motion, slope_deg, robot, ground) | {"frames": frames(motion, robot)}
    return htmlsafe_json_dumps(contents, separators=(",", ":"))


def scene(motion: Motion, slope_deg: float, robot: Robot, ground: Heights | None) -> dict[str, Any]:
    """What stands still in the picture, and the machine's own measures."""
    model = robot.model
    body, drill = robot.machine.body, robot.machine.drill_body
    drills = "drill_mast" not in lacking(robot.machine.urdf)
    return {
        "size": robot.machine.scale.length,
        "slope": slope_deg,
        "ground": _ground(motion, ground),
        "box": _whole([*np.array(body.inertia_box_m) / 2.0], MM),
        "hips": _whole(robot.legs.hips_m, MM),
        "sheaves": _whole(model.rope_attachments_m, MM),
        "mast": _whole([*model.drill_mount_m, drill.mast_length_m], MM) if drills else None,
    }


def arrows(robot: Robot) -> str:
    """How long the arrow of a force is, in words."""
    scale = robot.machine.scale
    return f"{100 * scale.length:.3g} mm is {2000 * scale.force:.0f} N"


def frames(motion: Motion, robot: Robot, start_m: Array | None = None) -> list[list[int]]:
    """A list of whole numbers for each moment. `start_m` (3): where the body began, if that is not
    the first moment.
    """
    count, tens = len(motion.time_s), TEN_N / robot.machine.scale.force
    start = motion.origin_m[0] if start_m is None else start_m
    columns = [
        MM * motion.time_s[:, None],
        MM * (motion.origin_m - start),
        MM * motion.turn[:, :, 0],
        MM * motion.turn[:, :, 2],
        MM * (motion.feet_m - start).reshape(count, -1),
        tens * motion.foot_force_n.reshape(count, -1),
        tens * motion.rope_force_n.reshape(count, -1),
        tens * motion.thrust_n[:, None],
        MM * motion.hole_m[:, None],
    ]
    table = np.nan_to_num(np.concatenate(columns, axis=1))
    rounded: list[list[int]] = np.rint(table).astype(int).tolist()
    return rounded


def _ground(motion: Motion, ground: Heights | None) -> Any:
    """Mean height of the first moment's feet, or the grid's corner, cell, columns and heights, all
    in mm.
    """
    start = motion.origin_m[0]
    if ground is None:
        return round(MM * float((motion.feet_m[0] - start)[:, 2].mean()))
    return {
        "corner": _whole([ground.x0_m - start[0], ground.y0_m - start[1]], MM),
        "cell": round(MM * ground.cell_m),
        "columns": ground.values_m.shape[1],
        "heights": _whole(ground.values_m - start[2], MM),
    }


def _whole(values: Any, factor: float) -> list[int]:
    scaled = np.nan_to_num(np.asarray(values, dtype=float).ravel() * factor)
    return [int(number) for number in np.rint(scaled)]


# The page of a run on its way: the moving wireframe, its loads, and what may be done to it.

SCRIPT = "live.js"
ROWS = (
    ("true", "foot load, truth [N]"),
    ("own", "foot load, own estimate [N]"),
    ("contact", "in contact"),
)
SINGLES = tuple((f"rope_{side}", f"{side} rope [N]") for side in SIDES)
PUSH_KN = 5.0
"""What a push begins with, of a machine as heavy as ROBOCLIMBER."""
NOW = np.array([0], dtype=np.int64)


class LivePage:
    """What a browser is sent of one run: the page once, then frames and numbers. `slope`, `ground`:
    by its scenario.
    """

    def __init__(self, scenario: Scenario, robot: Robot) -> None:
        self._scenario, self._robot = scenario, robot
        self._start: Motion | None = None

    def frame(self, data: Columns, truth: Columns) -> list[int]:
        """The moment of one recorded row as animation.js draws it."""
        motion = motion_at(data, truth, self._scenario.terrain.slope_deg, self._robot, NOW)
        if self._start is None:
            self._start = motion
        return frames(motion, self._robot, self._start.origin_m[0])[0]

    def cells(self, data: Columns, truth: Columns) -> dict[str, str]:
        """Id of a cell of the page -> its text, of one recorded row."""
        found = {f"rope_{side}": f"{rope_tension_n(truth, side)[0]:.0f}" for side in SIDES}
        for leg in LEGS:
            found[f"true_{leg}"] = f"{truth[f'foot_load_{leg}'][0]:.0f}"
            found[f"own_{leg}"] = f"{data[f'estimate_own_{leg}'][0]:.0f}"
            found[f"contact_{leg}"] = "yes" if data[f"contact_{leg}"][0] > 0.0 else "no"
        return found

    def text(self, key: str) -> str:
        """The page. `key`: what its script shows the server, so that no other page may order
        anything.
        """
        from jinja2.utils import htmlsafe_json_dumps

        assert self._start is not None, "a frame comes first"
        terrain, start = self._scenario.terrain, self._start
        ground = heights_around(terrain, start.feet_m[:, :, :2].reshape(-1, 2))
        still = scene(start, terrain.slope_deg, self._robot, ground) | {
            "frames": frames(start, self._robot)
        }
        contents: dict[str, Any] = {
            "title": f"{self._scenario.name}, seed {self._scenario.seed}",
            "legs": LEGS,
            "rows": ROWS,
            "singles": SINGLES,
            "friction": terrain.friction,
            "arrows": arrows(self._robot),
            "push_kn": f"{PUSH_KN * self._robot.machine.scale.force:g}",
            "animation": htmlsafe_json_dumps(still),
            "told": htmlsafe_json_dumps({"key": key}),
            "live_script": script(SCRIPT),
            "policy": policy(SCRIPT, asks="'self'"),
        }
        return render("live.html.j2", contents)
