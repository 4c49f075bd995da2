"""Sharing the load out: the agent corrects the plan of the quadratic program on cases like the
benchmark's.

Actions in [-1, 1] (6): what is wanted beyond the plan, +-2000 N of normal load on fl fr rl rr (of
these only what leaves the body still can be had) and +-2000 N of pull on the left and right rope.
No action is the program itself.
Observation: control/distribution/corrected.py's VIEW.
"""

from __future__ import annotations

import numpy as np

from testbed.control.distribution.controllers import distribution
from testbed.control.distribution.corrected import PULL_N, SHARE_N, Corrected
from testbed.control.gait import Layered
from testbed.control.layers import Trim
from testbed.envs.base import Observation, RoboclimberEnv
from testbed.envs.observations import SHARE_TABLE, action_rows
from testbed.formats.arrays import Array
from testbed.machine.names import LEGS, SIDES
from testbed.scenario.scenario import Scenario

FOOTING_SD_M = 7.0e-4
"""Height error of each footing, drawn anew in every episode (E)."""
SETTLE_S = 1.0
"""Position hold at the start, in which the footing comes in."""


class ForceDistributionEnv(RoboclimberEnv):
    """`Roboclimber/ForceDistribution-v0`: the agent corrects the plan of the quadratic program on
    random cases.
    """

    table = SHARE_TABLE
    actions = (
        *action_rows("normal load of {} beyond the plan's", LEGS, "N", "body z", SHARE_N),
        *action_rows("pull of the {} rope beyond the plan's", SIDES, "N", "along it", PULL_N),
    )

    def _begin(self, spec: Scenario) -> None:
        machine = self._sim.machine
        self._sharing = Corrected()
        self._trim = Trim(self.scale)
        footing_sd_m = self.scale.length * FOOTING_SD_M
        self._trim.goal_m = self.np_random.normal(0.0, footing_sd_m, len(LEGS))
        machine.gait = Layered(machine.gait, (self._trim,))
        ropes = machine.expectation.surveyed.turned(machine.ground.rotation_slope_to_world.T)
        self._layer = distribution(machine.belief, ropes, self._sharing)

    def _settle(self) -> tuple[Array, Array]:
        sim, rows = self._sim, round(SETTLE_S / self._step_s) * self._rows
        sim.run_block(rows)
        sim.machine.gait = Layered(sim.machine.gait, (self._layer,))
        data, truth = sim.run_block(self._rows)
        return data, truth

    def _order(self, action: Array) -> None:
        self._sharing.order(action)

    def _observe(self, data: Array) -> Observation:
        return self._in_form(self._sharing.view().astype(np.float32))
