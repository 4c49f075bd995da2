"""Keeping the stance: a rope parts or slips at an unknown time, a foot stands on something
slippery, or both.

Twenty times a second the agent orders the speed of both ropes, how fast one diagonal of feet is
raised over the other and the front over the rear, and how fast the body moves up or down the slope
over its feet. From the first fault on, each second is paid in which the feet stay where they were;
the pay fades with the furthest way that any of them has slipped since the start, before the fault
or after it. Nothing is lost by an action, and nothing is gained by an early end.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.control.gait import Layered, amounts
from testbed.control.layers import OFFSET_SPEED_M_S, SHIFT_SPEED_M_S, Orders, Shift, Trim
from testbed.envs.base import RoboclimberEnv
from testbed.envs.observations import KEEP_TABLE, OFFSET_RANGE_M, action_rows
from testbed.envs.rewards import Term, Truth
from testbed.formats.arrays import Array, Flags
from testbed.machine.names import SIDES
from testbed.recording.rows import DataRow
from testbed.scenario.scenario import Scenario

HAUL_M_S = 0.06
"""Speed of a rope for an action of 1: the traction devices' fastest (E)."""
RAISE_M_S = OFFSET_SPEED_M_S
"""Speed of the vertical set points for an action of 1; a millimetre is some kilonewtons."""
DIAGONAL, FRONT = np.array([1.0, -1.0, -1.0, 1.0]), np.array([1.0, 1.0, -1.0, -1.0])
"""Which feet an action raises over which, LEGS order."""
SHIFT_RANGE_M = 0.12
"""Furthest that the body goes up or down the slope over its feet."""
SLIP_M = 0.15
"""A foot that has slipped so far is paid nothing any more: half of what counts as sliding (E)."""
HELD_M = 0.05
"""A stance in which no foot has slipped further is held: a third of that (E)."""
HELD = Term(
    "held",
    f"time since the fault, fading with the furthest slip to nothing at {SLIP_M} m",
    "s",
    1.0,
)
MOVED_M = 1.0e-3
"""A foot that slips by less in a step rests."""


class KeepEnv(RoboclimberEnv):
    """`Roboclimber/Keep-v0`: hold the stance when a rope parts or slips, or a foot stands on
    something slippery.
    """

    table = KEEP_TABLE
    actions = (
        *action_rows("speed of the {} rope, + hauls in", SIDES, "m/s", "along it", HAUL_M_S),
        *action_rows(
            "speed of the vertical set points of {}",
            ["fl and rr, less of fr and rl", "fl and fr, less of rl and rr"],
            "m/s",
            "joint",
            RAISE_M_S,
        ),
        *action_rows(
            "speed of the {} over its feet, + up", ["body"], "m/s", "slope", SHIFT_SPEED_M_S
        ),
    )
    terms = (HELD,)

    @property
    def _paid_to_m(self) -> float:
        return self.scale.length * SLIP_M

    def _begin(self, spec: Scenario) -> None:
        self.fault_s = min((event.at_s for event in spec.events), default=0.0)
        self._hauled, self._raised_m = np.zeros(len(SIDES)), np.zeros(2)
        self._shifted_m = 0.0
        self._slip_m = self._slipped_s = 0.0
        machine = self._sim.machine
        self._trim, self._orders = Trim(self.scale), Orders()
        self._shift = Shift(machine.belief.model, self.scale)
        machine.gait = Layered(machine.gait, (self._trim, self._shift, self._orders))

    def _settle(self) -> tuple[Array, Array]:
        data, truth = self._sim.run_block(self._rows)
        self._first_pull = DataRow.from_table(data)["rope_tension"].mean(axis=0)
        return data, truth

    def _order(self, action: Array) -> None:
        speeds = amounts(action, self.actions)
        ropes, raised, shifted = np.split(speeds, [len(SIDES), len(SIDES) + 2])
        self._orders.rope_rates_m_s = -ropes
        self._hauled = self._hauled + ropes * self._step_s
        furthest_m = self.scale.length * np.array([OFFSET_RANGE_M, SHIFT_RANGE_M])
        raised_m = self._raised_m + raised * self._step_s
        self._raised_m = np.clip(raised_m, -furthest_m[0], furthest_m[0])
        self._trim.goal_m = self._raised_m @ np.array([DIAGONAL, FRONT])
        shifted_m = self._shifted_m + float(shifted[0]) * self._step_s
        self._shifted_m = min(max(shifted_m, -furthest_m[1]), furthest_m[1])
        self._shift.goal_m = np.array([self._shifted_m, 0.0])

    def _ordered(self) -> dict[str, float]:
        tension = np.asarray(self._sim.row["rope_tension"])
        return {
            "orders.diagonal": self._raised_m[0],
            "orders.front": self._raised_m[1],
            "orders.shift": self._shifted_m,
            **{f"orders.hauled_{side}": self._hauled[index] for index, side in enumerate(SIDES)},
            **{
                f"control.pull_change_{side}": tension[index] - self._first_pull[index]
                for index, side in enumerate(SIDES)
            },
        }

    def _amounts(self, truth: Truth, action: Array, ended: bool) -> dict[str, float]:
        del truth, action
        t_s, slip = self._sim.t_s, float(self._sim.machine.judge.slip_m)
        if slip > self._slip_m + self.scale.length * MOVED_M:
            self._slipped_s = t_s
        self._slip_m = slip
        since = min(max(t_s - self.fault_s, 0.0), self._step_s)
        return {"held": 0.0 if ended else since * max(0.0, 1.0 - slip / self._paid_to_m)}

    @property
    def most_left(self) -> float:
        """See the base class: from here on no foot slips any further."""
        left_s = float(self._sim.scenario.duration_s - max(self._sim.t_s, self.fault_s))
        return max(left_s, 0.0) * max(0.0, 1.0 - self._slip_m / self._paid_to_m)

    def action_masks(self) -> Flags:
        """See the base class: a rope that is not there cannot be hauled."""
        whole = np.asarray(self._sim.machine.boards["ropes"]["whole"][0]) > 0.0
        return np.concatenate([whole, [True, True, True]])

    def _info(self, truth: Truth, data: Array) -> dict[str, Any]:
        slip = float(self._sim.machine.judge.slip_m)
        return {
            **super()._info(truth, data),
            "slip_m": slip,
            "held": bool(slip <= self.scale.length * HELD_M and self._sim.verdict == "stood"),
            "fault_s": self.fault_s,
            "caught_s": max(self._slipped_s - self.fault_s, 0.0),
        }
