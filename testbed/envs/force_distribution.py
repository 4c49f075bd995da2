"""Sharing the load out: the agent corrects the plan of the quadratic program on cases like the benchmark's.

Actions in [-1, 1] (6): what is wanted beyond the plan, +-2000 N of normal load on fl fr rl rr (of these only what
leaves the body still can be had) and +-2000 N of pull on the left and right rope. No action is the program itself.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from testbed.control.controllers import distributed
from testbed.control.distribution import Plan
from testbed.control.quadratic import Quadratic
from testbed.control.statics import NORMALS, ROPES, Balance
from testbed.control.trim import Trim
from testbed.envs.base import RoboclimberEnv
from testbed.envs.observations import SHARE_TABLE
from testbed.parameters.names import LEGS
from testbed.parameters.scenario import Scenario

Array = NDArray[np.float64]
SHARE_N, PULL_N = 2000.0, 2000.0
FOOTING_SD_M = 7.0e-4
"""Height error of each footing, drawn anew in every episode (E)."""
SETTLE_S = 1.0
"""Position hold at the start, in which the footing comes in."""


class Corrected:
    """The quadratic program's plan plus what is wanted beyond it."""

    name = "corrected"

    def __init__(self) -> None:
        self.inner = Quadratic()
        self.load_n, self.pull_n = np.zeros(len(LEGS)), np.zeros(2)

    def plan(self, now: Balance) -> Plan:
        """See Sharing."""
        plan = self.inner.plan(now)
        forces = plan.forces.copy()
        forces[NORMALS] += self.load_n
        forces[ROPES] = np.maximum(forces[ROPES] + self.pull_n, 0.0)
        return replace(plan, forces=forces)


class ForceDistributionEnv(RoboclimberEnv):
    """`Roboclimber/ForceDistribution-v0`."""

    table = SHARE_TABLE

    def _begin(self, spec: Scenario) -> None:
        machine = self._sim.machine
        self._friction = spec.terrain.friction
        self._sharing = Corrected()
        self._trim = Trim(machine.program)
        self._trim.goal_m = self.np_random.normal(0.0, FOOTING_SD_M, len(LEGS))
        machine.program = self._trim
        ropes = machine.expectation.rope_directions_in_world @ machine.ground.rotation_slope_to_world
        self._program = distributed(spec, self._trim, ropes, self._sharing)

    def _settle(self) -> tuple[Array, Array]:
        rows = round(SETTLE_S / self._step_s) * self._rows
        data, truth = self._sim.run_block(rows)
        self._sim.machine.program = self._program
        return data[-self._rows :], truth[-self._rows :]

    def _order(self, action: Array) -> None:
        self._sharing.load_n = SHARE_N * action[: len(LEGS)]
        self._sharing.pull_n = PULL_N * action[len(LEGS) :]

    def _ordered(self) -> Array:
        plan = self._program.plan
        pull = plan.forces[ROPES] if plan is not None else np.zeros(2)
        return np.concatenate([self._sharing.load_n, pull])
