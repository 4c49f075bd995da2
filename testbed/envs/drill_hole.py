"""Drilling in rock that nobody knows: once a second the agent sets feed and hammer, rope pulls and
the diagonal's load.

The quadratic program shares the load out below, a hundred times a second; pulls and loads are what
is wanted beyond its plan. Metres are paid, lost and slipped feet cost. The machine as it is shipped
does HANDBOOK all the time.
"""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np

from testbed.control.distribution.controllers import distribution
from testbed.control.distribution.corrected import PULL_N, SHARE_N, Corrected
from testbed.control.gait import Layered, Observed, amounts
from testbed.control.layers import Orders
from testbed.envs.base import TICK_MS, RoboclimberEnv
from testbed.envs.observations import HOLE_TABLE, action_rows
from testbed.envs.rewards import END, LOST, Term, Truth
from testbed.errors import InputError
from testbed.formats.arrays import Array, Flags
from testbed.machine.model import Machine
from testbed.machine.names import SIDES
from testbed.scenario.drilling import DrillHole
from testbed.scenario.scenario import Scenario

FEED_N = 5.5e3
"""Feed for an action of 0: the handbook's best one in medium rock."""
FEED_RANGE_N = 5.0e3
"""By how much an action of 1 raises it."""
DIAGONAL = np.array([1.0, -1.0, -1.0, 1.0])
DEPTH = Term("depth", "way of the bit into the rock", "m", 100.0)
SLIP = Term("slip", "further slip of the foot that slipped most", "m", -100.0)
HANDBOOK = np.array([0.0, 1.0, 0.0, 0.0, 0.0], dtype=np.float32)
"""An action: the handbook's feed and the full hammer."""
AT_WORK = ("collar", "drill")
TICK_S = 1e-3 * TICK_MS
"""Of the drill."""


class DrillHoleEnv(RoboclimberEnv):
    """`Roboclimber/DrillHole-v0`: drill as deep as time allows into rock that nobody knows, all
    feet on the slope.
    """

    table = HOLE_TABLE
    actions = (
        Observed(
            "action_feed",
            "feed force while drilling",
            "N",
            "body z",
            FEED_N - FEED_RANGE_N,
            FEED_N + FEED_RANGE_N,
        ),
        Observed("action_hammer", "share of the hammer's energy", "1", "-", 0, 1),
        *action_rows("pull of the {} rope beyond the plan's", SIDES, "N", "along it", PULL_N),
        *action_rows(
            "normal load of {} beyond the plan's",
            ["fl and rr, less of fr and rl,"],
            "N",
            "body z",
            SHARE_N,
        ),
    )
    terms = (DEPTH, LOST, SLIP, END)

    def _begin(self, spec: Scenario) -> None:
        if not isinstance(spec.task, DrillHole):
            raise InputError(
                "drills no hole", field="task.kind", value=spec.task.kind, allowed="drill_hole"
            )
        self._task, self._end_s = spec.task, float(spec.duration_s)
        self._orders, self._sharing = Orders(), Corrected()
        self._slip_m = self._diagonal = 0.0
        machine = self._sim.machine
        ropes = machine.expectation.surveyed.turned(machine.ground.rotation_slope_to_world.T)
        layer = distribution(machine.belief, ropes, self._sharing)
        machine.gait = Layered(machine.gait, (layer, self._orders))

    def _settle(self) -> tuple[Array, Array]:
        """Until the bit is at work."""
        drill = self._sim.machine.drill
        rows = round(self._step_s * self._sim.scenario.rates.record_hz)
        data, truth = self._sim.run_block(rows)
        while drill.phase not in AT_WORK and not self._sim.finished:
            data, truth = self._sim.run_block(rows)
        self._depth_m, self._bit_m, self._rate_m_s = drill.depth_m, self._bit_known_m(), 0.0
        return data, truth

    @property
    def task(self) -> DrillHole:
        """How the drill is worked."""
        return self._task

    @property
    def believed(self) -> Machine:
        """The machine that control believes in."""
        believed: Machine = self._sim.machine.belief.machine
        return believed

    @property
    def reserve_n(self) -> float:
        """Thrust at which a foot would leave, as reckoned at the start."""
        return float(self._sim.machine.thrust.reserve_n)

    @property
    def best_feed_n(self) -> float:
        """Best feed for the rock that the bit is in: a truth, for oracles alone."""
        drill = self._sim.machine.drill
        return float(drill.best_feed_n(drill.depth_m))

    def most_paid(self) -> float:
        """What the rest of the episode pays for a bit that is pressed all the time as is best for
        the rock that it is in, no foot minded: nobody can be paid more. A truth, for oracles alone.
        """
        drill, t, end = copy.deepcopy(self._sim.machine.drill), self._sim.t_s, self._end_s
        begun_m, drill.most_n, drill.hammer = drill.depth_m, math.inf, 1.0
        while t < end - 0.5 * TICK_S:
            drill.feed_n = drill.best_feed_n(drill.depth_m)
            drill.update(t, TICK_S)
            t += TICK_S
        return self._weights["depth"] * float(drill.depth_m - begun_m)

    def _bit_known_m(self) -> float:
        """Depth of the bit by the drill's own count of its rods."""
        row = self._sim.row
        return float(row["rods_in_hole"]) / self._task.rod_kg * self._task.rod_length_m

    def _order(self, action: Array) -> None:
        feed_n, hammer, *_ = amounts(action, self.actions)
        self._orders.feed_n, self._orders.hammer = float(feed_n), float(hammer)
        self._diagonal = float(action[4])
        self._sharing.order(np.concatenate([self._diagonal * DIAGONAL, action[2:4]]))

    def _ordered(self) -> dict[str, float]:
        feed = self._task.feed_n if self._orders.feed_n is None else self._orders.feed_n
        drill = self._sim.machine.drill
        bit_m = self._bit_known_m()
        self._rate_m_s = (bit_m - self._bit_m) / self._step_s
        self._bit_m = bit_m
        return {
            "orders.feed": feed,
            "orders.hammer": self._orders.hammer,
            "orders.diagonal": self.scale.times("N") * SHARE_N * self._diagonal,
            "control.bit_rate": self._rate_m_s,
            "control.drilling": float(drill.phase in AT_WORK),
            "control.jammed": float(drill.phase == "jam"),
            "control.thrust_reserve": self._sim.machine.thrust.reserve_n,
        }

    def _amounts(self, truth: Truth, action: Array, ended: bool) -> dict[str, float]:
        del action
        depth, slip = self._sim.machine.drill.depth_m, self._sim.machine.judge.slip_m
        gained, slipped = depth - self._depth_m, slip - self._slip_m
        self._depth_m, self._slip_m = depth, slip
        lost = float(truth.feet_lost) * self._step_s
        return {"depth": gained, "lost": lost, "slip": slipped, "end": float(ended)}

    def action_masks(self) -> Flags:
        """See the base class: feed and hammer have a say while the bit is at work."""
        works = self._sim.machine.drill.phase in AT_WORK
        return np.array([works, works, True, True, True])

    def _info(self, truth: Truth, data: Array) -> dict[str, Any]:
        drill = self._sim.machine.drill
        known = {"depth_m": float(drill.depth_m), "phase": drill.phase}
        return {**super()._info(truth, data), **known, "slip_m": float(self._slip_m)}
