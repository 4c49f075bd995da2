"""The page of a run on its way: the moving wireframe, its loads, and what may be done to it."""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.formats.arrays import Columns
from testbed.machine.names import LEGS, SIDES
from testbed.report.animation import arrows, frames, scene
from testbed.report.motion import Motion, heights_around, motion_at
from testbed.report.page import policy, render, script
from testbed.robot.robot import Robot
from testbed.scenario.scenario import Scenario
from testbed.simulation.metrics import rope_tension_n

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
    """What a browser is told of one run: the page once, then frames and numbers. `slope`, `ground`:
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
