"""The plan of the quadratic program with corrections that an agent adds to it, and the observation
from which the agent chooses them.

An agent that learns sees what a Controller sees, as one vector: the plan, how far the measured
forces are off it, what the measured forces lack of balancing the load (wrong estimates show there),
and its own last orders.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from testbed.control.distribution.distribution import Plan
from testbed.control.distribution.quadratic import Quadratic
from testbed.control.distribution.statics import FEET, NORMALS, ROPES, UNKNOWNS, Balance
from testbed.control.gait import Observed
from testbed.formats.arrays import Array
from testbed.machine.names import LEGS, SIDES
from testbed.machine.scale import ROBOCLIMBER, Scale

SHARE_N = 2000.0
"""Normal load of a foot of ROBOCLIMBER beyond the plan's for an action of 1."""
PULL_N = 2000.0
"""Pull of one of its ropes beyond the plan's for an action of 1."""
VIEW_S = 0.1
"""Time constant of what is measured in the view (E): blows are left out, slow errors are seen."""


def _feet(name: str, what: str, low: float, high: float, across: float) -> list[Observed]:
    rows = []
    for leg in LEGS:
        load, along = f"{what}, normal load of {leg}", f"{what}, ground on {leg} along"
        rows.append(Observed(f"control.{name}_{leg}_z", load, "N", "body z", low, high))
        rows += [
            Observed(
                f"control.{name}_{leg}_{axis}",
                f"{along} {axis}",
                "N",
                f"body {axis}",
                -across,
                across,
            )
            for axis in "xy"
        ]
    return rows


def _ropes(name: str, what: str, low: float, high: float) -> list[Observed]:
    return [
        Observed(f"{name}_{side}", f"{what}, {side} rope", "N", "along it", low, high)
        for side in SIDES
    ]


def _lacking(name: str, what: str, unit: str) -> list[Observed]:
    said = f"{what} that they lack of balance"
    return [
        Observed(f"control.lacks_{name}{axis}", said, unit, f"body {axis}", -1e3, 1e3)
        for axis in "xyz"
    ]


VIEW: tuple[Observed, ...] = (
    *_feet("plan", "planned", 0.0, 1.5e4, 4e3),
    *_ropes("control.plan_pull", "planned pull", 0.0, 3.2e4),
    *_feet("off", "measured less planned", -1e3, 1e3, 1e3),
    *_ropes("control.off_pull", "measured less planned", -1e3, 1e3),
    *_lacking("f", "force", "N"),
    *_lacking("m", "moment", "N m"),
    Observed("control.thrust", "believed thrust of the drill", "N", "body z", -6e3, 6e3),
    *(
        Observed(f"orders.share_{leg}", f"load wanted on {leg}", "N", "body z", -2e3, 2e3)
        for leg in LEGS
    ),
    *_ropes("orders.pull", "pull wanted beyond the plan's", -2e3, 2e3),
)
"""What the agent sees, index by index."""
_BEYOND = np.array([SHARE_N] * len(LEGS) + [PULL_N] * len(SIDES))


@cache
def _ends(scale: Scale) -> Array:
    """(2, len(VIEW)) ranges of the view on a machine of this size."""
    rows = [row.times(scale.times(row.unit)) for row in VIEW]
    return np.array([[row.low, row.high] for row in rows]).T


class Corrected(Quadratic):
    """See the module's docstring. `order` takes an action; no action is the program itself."""

    def __init__(self) -> None:
        super().__init__()
        self._shares, self._scale = np.zeros(len(_BEYOND)), ROBOCLIMBER
        self._planned = np.zeros(UNKNOWNS)
        self._measured: Array | None = None
        self._lacks, self._thrust_n = np.zeros(6), 0.0
        self._posture: tuple[Array, list[bool], Array] = np.empty(0), [], np.empty(0)

    def order(self, action: Array) -> None:
        """Take an action (6,) in [-1, 1]: normal loads of fl fr rl rr and pulls of the left and
        right rope.
        """
        self._shares = np.array(action, dtype=np.float64)

    @property
    def beyond_n(self) -> Array:
        """(6,) what is wanted beyond the plan: loads of fl fr rl rr, pulls left and right."""
        return self._scale.times("N") * _BEYOND * self._shares

    def plan(self, now: Balance) -> Plan:
        """See Controller."""
        plan = super().plan(now)
        self._look(now, plan)
        wanted, more = plan.forces.copy(), self.beyond_n
        wanted[NORMALS] += more[: len(LEGS)]
        wanted[ROPES] = np.maximum(wanted[ROPES] + more[len(LEGS) :], 0.0)
        beyond = wanted - plan.forces
        # The feet take what would move the body.
        wanted[:FEET] -= self._borne(now) @ (now.balance @ beyond)
        return replace(plan, forces=wanted)

    def _borne(self, now: Balance) -> Array:
        """(12, 6) the smallest forces of the stance feet that bear a unit wrench; worked out once a
        posture.
        """
        balance, stance, borne = self._posture
        if balance is not now.balance or stance != now.stance.tolist():
            borne = np.asarray(
                np.linalg.pinv(now.balance[:, :FEET] * np.repeat(now.stance, 3)), dtype=np.float64
            )
            self._posture = now.balance, now.stance.tolist(), borne
        return borne

    def view(self) -> Array:
        """(len(VIEW),) what the agent sees after the last plan, each row from [low, high] to [-1,
        1], clipped.
        """
        off = np.zeros(UNKNOWNS) if self._measured is None else self._measured - self._planned
        raw = np.concatenate([self._planned, off, self._lacks, [self._thrust_n], self.beyond_n])
        low, high = _ends(self._scale)
        return np.asarray(np.clip((2.0 * raw - low - high) / (high - low), -1.0, 1.0))

    def _look(self, now: Balance, plan: Plan) -> None:
        self._scale = now.scale
        if self._measured is None:
            self._measured = now.measured.copy()
        self._measured += 0.01 / VIEW_S * (now.measured - self._measured)
        self._planned = plan.forces
        self._lacks = -(now.balance @ self._measured + now.load)
        self._thrust_n = now.thrust_n
