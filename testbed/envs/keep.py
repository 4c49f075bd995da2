"""Keeping the stance: a rope parts or slips at an unknown time, a foot stands on something
slippery, or both.

Ten times a second the agent orders the speed of both ropes and moves the four vertical set points.
From the first fault on, each second is paid in which the feet stay where they were; the pay fades
with the furthest way that any of them has slipped since the start. Nothing is lost by an action,
and nothing is gained by an early end.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.control.gait import Layered
from testbed.control.layers.orders import Orders
from testbed.control.layers.trim import Trim
from testbed.envs.base import OFFSET_RANGE_M, RoboclimberEnv, action_rows
from testbed.envs.observations import KEEP_TABLE
from testbed.envs.rewards import Term, Truth
from testbed.machine.names import LEGS, SIDES
from testbed.recording.rows import DataRow
from testbed.scenario.scenario import Scenario

Array = NDArray[np.float64]
HAUL_M_S = 0.06
"""Speed of a rope for an action of 1: the traction devices' fastest (E)."""
RAISE_M = 1.0e-3
"""Increment of a vertical set point for an action of 1: ten encoder counts, some kilonewtons."""
SLIP_M = 0.15
"""A foot that has slipped so far is paid nothing any more: half of what counts as sliding (E)."""
HELD = Term(
    "held",
    f"time since the fault, fading with the furthest slip to nothing at {SLIP_M} m",
    "s",
    1.0,
)


class KeepEnv(RoboclimberEnv):
    """`Roboclimber/Keep-v0`: hold the stance when a rope parts or slips, or a foot stands on
    something slippery.
    """

    table = KEEP_TABLE
    actions = (
        *action_rows("speed of the {} rope, + hauls in", SIDES, "m/s", "along it", HAUL_M_S),
        *action_rows("vertical set point of {}, increment", LEGS, "m", "joint", RAISE_M),
    )
    terms = (HELD,)

    def _begin(self, spec: Scenario) -> None:
        self._friction = spec.terrain.friction
        self.fault_s = min((event.at_s for event in spec.events), default=0.0)
        self._hauled = np.zeros(len(SIDES))
        self._trim, self._orders = Trim(), Orders()
        machine = self._sim.machine
        machine.gait = Layered(machine.gait, (self._trim, self._orders))

    def _settle(self) -> tuple[Array, Array]:
        data, truth = self._sim.run_block(self._rows)
        self._first_pull = DataRow.from_table(data)["rope_tension"].mean(axis=0)
        return data, truth

    def _order(self, action: Array) -> None:
        self._orders.rope_rates_m_s = -HAUL_M_S * action[: len(SIDES)]
        self._hauled = self._hauled + HAUL_M_S * action[: len(SIDES)] * self._step_s
        goal = self._trim.goal_m + RAISE_M * action[len(SIDES) :]
        self._trim.goal_m = np.clip(goal, -OFFSET_RANGE_M, OFFSET_RANGE_M)

    def _ordered(self) -> dict[str, float]:
        tension = np.asarray(self._sim.row["rope_tension"])
        return {
            **{f"orders.offset_{leg}": self._trim.goal_m[index] for index, leg in enumerate(LEGS)},
            **{f"orders.hauled_{side}": self._hauled[index] for index, side in enumerate(SIDES)},
            **{
                f"control.pull_change_{side}": tension[index] - self._first_pull[index]
                for index, side in enumerate(SIDES)
            },
        }

    def _amounts(self, truth: Truth, action: Array, ended: bool) -> dict[str, float]:
        del truth, action
        since = min(max(self._sim.t_s - self.fault_s, 0.0), self._step_s)
        kept = max(0.0, 1.0 - self._sim.machine.judge.slip_m / SLIP_M)
        return {"held": 0.0 if ended else since * kept}

    def action_masks(self) -> NDArray[np.bool_]:
        """See the base class: a rope that is not there cannot be hauled."""
        whole = np.asarray(self._sim.machine.boards["ropes"]["whole"][0]) > 0.0
        return np.concatenate([whole, np.ones(len(LEGS), dtype=bool)])

    def _info(self, truth: Truth, data: Array) -> dict[str, Any]:
        slip = float(self._sim.machine.judge.slip_m)
        return {**super()._info(truth, data), "slip_m": slip, "fault_s": self.fault_s}
