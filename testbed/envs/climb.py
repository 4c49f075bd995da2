"""Climbing: the crawl's set points with the agent's offsets and rope pulls over them; paid for the
way up the slope.
"""

from __future__ import annotations

import math
from typing import Any

import gymnasium
import numpy as np

from testbed.control.gait import Layered, amounts
from testbed.control.gaits.crawl.gait import CrawlGait
from testbed.control.gaits.crawl.walk_plan import Stride
from testbed.envs.base import RoboclimberEnv
from testbed.envs.observations import CLIMB_TABLE, action_rows
from testbed.envs.rewards import EFFORT, END, FRICTION_USE, LOST, Term, Truth, holding_amounts
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.scenario.scenario import Scenario
from testbed.scenario.tasks import Crawl

WAY_UP = Term("way", "way of the body up the slope", "m", 100.0)
OUTDATED = "Climb-v0 pays a quick slide better than a climb: kept for comparison, train on Climb-v1"


class ClimbEnv(RoboclimberEnv):
    """`Roboclimber/Climb-v0`: the scenario crawl_slope_30 as an environment; outdated."""

    terms = (WAY_UP, FRICTION_USE, LOST, EFFORT, END)

    def __init__(self, **arguments: Any) -> None:
        gymnasium.logger.warn(OUTDATED)
        super().__init__(**arguments)

    def _begin(self, spec: Scenario) -> None:
        super()._begin(spec)
        slope = math.radians(spec.terrain.slope_deg)
        self._up_in_world = np.array([math.cos(slope), 0.0, math.sin(slope)])

    def _amounts(self, truth: Truth, action: Array, ended: bool) -> dict[str, float]:
        amounts = holding_amounts(truth, action, ended)
        kept = {term.name: amounts[term.name] for term in self.terms if term is not WAY_UP}
        return {"way": float(truth.way_in_world_m @ self._up_in_world), **kept}


STRIDE_M = 0.15
"""By how much an action of 1 lengthens the task's stride."""
HEIGHT_M = 0.03
"""By how much an action of 1 raises the task's swings."""
HASTE = 0.4
"""By how much an action of 1 raises the share of pump and valves that is asked for."""
LEAST_STRIDE_M, LEAST_HEIGHT_M = 0.05, 0.02
"""Shortest stride and lowest swing of a machine of ROBOCLIMBER's size (E)."""
WAY = Term("way", "way of the body up the slope", "m", 100.0)
TIME = Term("time", "simulated time", "s", -0.5)
ENERGY = Term("energy", "work of the pump", "kJ", -0.02)
SLIP = Term("slip", "further slip of the foot that slipped most", "m", -100.0)


class ClimbStepsEnv(RoboclimberEnv):
    """`Roboclimber/Climb-v1`: climb far, fast and with little energy by decisions of the gait, one
    a group of swings.

    Before every group the agent says how far, how high, how fast, how tight; a step lasts as long
    as the group does, some ten seconds. Metres are paid; time, energy, lost and slipped feet cost.
    No action is the shipped crawl.
    """

    table = CLIMB_TABLE
    actions = (
        *action_rows(
            "{} of the next group of swings, beyond the task's", ["stride"], "m", "slope", STRIDE_M
        ),
        *action_rows(
            "{} of the next group of swings, beyond the task's", ["height"], "m", "slope", HEIGHT_M
        ),
        *action_rows(
            "{}: share of pump and valves that is asked for, beyond the usual",
            ["haste"],
            "1",
            "-",
            HASTE,
        ),
    )
    terms = (WAY, TIME, ENERGY, LOST, SLIP, END)

    def _begin(self, spec: Scenario) -> None:
        task, gait = spec.task, self._sim.machine.gait
        if isinstance(gait, Layered):  # whoever shares the load out goes on below the agent
            gait = gait.gait
        if not isinstance(task, Crawl) or not isinstance(gait, CrawlGait):
            raise InputError(
                "does not crawl", field="task.kind", value=spec.task.kind, allowed="crawl"
            )
        self._task, self._gait = task, gait
        self._stride, self._haste = Stride(task.step_length_m, task.swing_height_m), 1.0
        self._slip_m = self._work_j = self._t_s = self._took_s = self._way_m = 0.0

    def _settle(self) -> tuple[Array, Array]:
        """Until the gait is about to begin."""
        rows = self._rows
        data, truth = self._sim.run_block(rows)
        start = self._task.start_s - 2.0 * self._step_s
        while self._sim.t_s < start and not self._sim.finished:
            data, truth = self._sim.run_block(rows)
        self._t_s, self._way_m = self._sim.t_s, self._up_m()
        self._work_j = float(self._sim.machine.board.supply.pump_work)
        return data, truth

    def _up_m(self) -> float:
        machine = self._sim.machine
        up = machine.ground.rotation_slope_to_world[:, 0]
        return float((machine.origin_in_world() - machine.start_base) @ up)

    def _order(self, action: Array) -> None:
        length_m, height_m, haste = (float(more) for more in amounts(action, self.actions))
        least = self.scale.length
        self._stride = Stride(
            max(self._task.step_length_m + length_m, least * LEAST_STRIDE_M),
            max(self._task.swing_height_m + height_m, least * LEAST_HEIGHT_M),
        )
        self._haste = 1.0 + haste
        self._gait.choose(self._stride, self._haste)

    def _run(self) -> tuple[Array, Array]:
        """Until a group of swings is done, or the run ends: where no stride is within reach any
        more or the task's steps are made, too.
        """
        groups = self._gait.groups
        data, truth = np.empty((0, 0)), np.empty((0, 0))
        blocks: list[tuple[Array, Array]] = []
        try:
            while not self._sim.finished and not self._gait.done:
                blocks.append(self._sim.run_block(1))
                if self._gait.groups > groups and self._gait.between_groups:
                    break
            self._sim.finished |= self._gait.done
        except InputError:
            self._sim.finished = True
        if blocks:
            data, truth = (np.concatenate(part) for part in zip(*blocks, strict=True))
        return data, truth

    def _ordered(self) -> dict[str, float]:
        return {
            "orders.stride": self._stride.length_m,
            "orders.height": self._stride.swing_height_m,
            "orders.haste": self._haste,
            "control.margin": min(self._gait.margins_n[-1:], default=0.0),
            "control.time": self._took_s,
        }

    def _amounts(self, truth: Truth, action: Array, ended: bool) -> dict[str, float]:
        del action
        slip, way = self._sim.machine.judge.slip_m, self._up_m()
        work, t_s = float(self._sim.machine.board.supply.pump_work), self._sim.t_s
        self._took_s = t_s - self._t_s
        amounts = {
            "way": way - self._way_m,
            "time": self._took_s,
            "energy": (work - self._work_j) / 1000.0,
            "lost": float(truth.feet_lost),
            "slip": slip - self._slip_m,
            "end": float(ended),
        }
        self._slip_m, self._way_m, self._work_j, self._t_s = slip, way, work, t_s
        return amounts

    def _info(self, truth: Truth, data: Array) -> dict[str, Any]:
        known = {"way_m": self._way_m, "work_j": self._work_j, "slip_m": float(self._slip_m)}
        return {**super()._info(truth, data), **known}
