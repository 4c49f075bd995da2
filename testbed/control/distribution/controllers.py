"""The force-distributing controllers by name: one line each; and the two plainest of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from testbed.control.distribution.corrected import VIEW, Corrected
from testbed.control.distribution.distribution import Controller, Distribution, Plan
from testbed.control.distribution.quadratic import Quadratic
from testbed.control.distribution.statics import FEET, NORMALS, ROPES, Balance, Statics
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.networks import read_network
from testbed.formats.sockets import FORM, is_user_class, load_object
from testbed.robot.robot import Robot
from testbed.robot.rope_bearings import SurveyedRopes

SURGE_N = 1500.0
"""Thrust that may come on top without warning: the peak of a blow's reaction (E)."""
OBSERVER_SHARE = 0.01
"""Part of the missing load that the observer takes over at each plan: 1 s at 100 Hz (E)."""
OBSERVER_LIMIT_N = 4000.0
"""No larger missing thrust is believed (E)."""


class DrillSharing(Quadratic):
    """Sharing for drilling: keep every foot loaded against the thrust that is and the thrust
    that may come.

    The program of quadratic.py with what a surge of the thrust takes off each foot: with
    SURGE_N more of it the friction used is still the least. What the thrust takes off a foot
    follows from four equally stiff legs, d n / d thrust = -N^+ wrench. The drill's true
    reaction is not the ordered one (blows, rods, a wrong payload): the sum of the estimated
    loads says how much is missing, and a slow observer adds that to the thrust.
    """

    def __init__(self, friction: float | None = None) -> None:
        super().__init__(friction)
        self.disturbance_n = 0.0
        """Thrust beyond the ordered one that the loads tell of, N, + away from the slope."""

    def plan(self, now: Balance) -> Plan:
        """See Controller."""
        self._observe(now)
        load = now.load + self.disturbance_n * now.thrust_map
        return replace(super().plan(replace(now, load=load)), load=load)

    def taken(self, now: Balance) -> Array:
        """(4,) what a surge takes off each foot, N."""
        return taken_by_thrust(now) * now.scale.force * SURGE_N

    def _observe(self, now: Balance) -> None:
        """The feet's normal loads must balance the rest along z; what lacks is a thrust nobody
        ordered.
        """
        if not now.stance.all():
            return
        pull = now.balance[2, ROPES] @ now.measured_pull_n
        missing = -(now.load[2] + pull) - float(now.measured_loads_n.sum())
        moved = self.disturbance_n + OBSERVER_SHARE * (missing - self.disturbance_n)
        most = now.scale.force * OBSERVER_LIMIT_N
        self.disturbance_n = float(np.clip(moved, -most, most))


def taken_by_thrust(now: Balance) -> Array:
    """(4,) change of the normal loads by a unit thrust, four equally stiff legs in stance."""
    normal = now.balance[2:5, NORMALS] * now.stance
    return np.asarray(-normal.T @ np.linalg.lstsq(normal @ normal.T, now.thrust_map[2:5])[0])


SHIPPED = Path(__file__).with_name("learned.npz")
"""The shipped policy."""
ACTIONS = 6
"""Loads of the four feet and pulls of the two ropes."""
EVERY = 2
"""Plans from action to action."""


class Learned(Corrected):
    """A trained correction of the quadratic program's plan: a small network of plain arrays,
    no learning library needed.

        action = clip(W3 tanh(W2 tanh(W1 view + b1) + b2) + b3, -1, 1)

    at every second plan (20 ms), as it was trained. The weights beside this file were made by the
    command in their entry `made_by`.

    `weights`: an .npz of `testbed train`; raises InputError for one that is none.
    """

    def __init__(self, weights: Path = SHIPPED) -> None:
        super().__init__()
        self._network, _ = read_network(weights)
        self._plans = 0
        if (self._network.inputs, self._network.outputs) != (len(VIEW), ACTIONS):
            raise InputError(
                "sees or does something else",
                file=weights,
                value=(self._network.inputs, self._network.outputs),
                allowed=f"{len(VIEW)} numbers in, {ACTIONS} out",
            )

    def plan(self, now: Balance) -> Plan:
        """See Controller."""
        if self._plans and self._plans % EVERY == 0:
            self.order(self.action(self.view()))
        self._plans += 1
        return super().plan(now)

    def action(self, view: Array) -> Array:
        """(6,) in [-1, 1] of a view (len(VIEW),)."""
        return self._network.answer(view)


class PseudoInverse:
    """The smallest foot forces that balance the load, ropes kept at the pull they had at the start.

    f = -G^T (G G^T)^-1 (load + ropes), G (6, 12). Knows neither friction nor that feet cannot pull.
    """

    def __init__(self) -> None:
        self._pull: Array | None = None

    def plan(self, now: Balance) -> Plan:
        """See Controller."""
        if self._pull is None:
            self._pull = now.measured_pull_n.copy()
        feet = now.balance[:, :FEET][:, np.repeat(now.stance, 3)]
        wrench = now.load + now.balance[:, ROPES] @ self._pull
        forces = np.zeros(FEET)
        forces[np.repeat(now.stance, 3)] = -feet.T @ np.linalg.solve(feet @ feet.T, wrench)
        return Plan(np.concatenate([forces, self._pull]))


class PositionHold:
    """The machine as built: cylinders keep their set points, ropes their lengths, loads fall as
    they may. The baseline; it never asks for anything.
    """

    def plan(self, now: Balance) -> Plan:
        """No wish: `feasible` is false, so nothing is laid over the set points."""
        return Plan(now.measured, feasible=False)


CONTROLLERS: dict[str, Callable[[], Controller]] = {
    "position_hold": PositionHold,
    "pseudo_inverse": PseudoInverse,
    "qp": Quadratic,
    "drill": DrillSharing,
    "learned": Learned,
}
"""The shipped ones; a scenario names them in control.distribution."""


def controller(name: str | type[Any] | Controller, field: str = "controller") -> Controller:
    """A fresh controller: a name of the table, `FILE.py:Class` for one of your own, or a trained
    `policy.npz`.

    A class is made, an object stays as it is. Raises InputError with the names there are.
    """
    if not isinstance(name, str):
        made: Controller = name() if isinstance(name, type) else name
        return made
    if name in CONTROLLERS:
        return CONTROLLERS[name]()
    if name.endswith(".npz"):
        return Learned(Path(name))
    if is_user_class(name):
        own: Controller = load_object(name, Controller, field=field)
        return own
    allowed = f"{', '.join(CONTROLLERS)}, {FORM} or policy.npz"
    raise InputError("no such controller", field=field, value=name, allowed=allowed)


def distribution(belief: Robot, ropes: SurveyedRopes, chosen: Controller) -> Distribution:
    """The layer that shares the load out the way `chosen` plans it. `ropes`: at the start, body
    frame.
    """
    return Distribution(Statics(belief.model, belief.machine, ropes), chosen)
