"""The force-distributing controllers by name: one line each; and the two plainest of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from testbed.control.distribution.distribution import Controller, Distribution, Plan
from testbed.control.distribution.drill_sharing import DrillSharing
from testbed.control.distribution.learned import Learned
from testbed.control.distribution.quadratic import Quadratic
from testbed.control.distribution.statics import FEET, ROPES, Balance, Statics
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.sockets import FORM, is_user_class, load_object
from testbed.robot.robot import Robot


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


def distribution(belief: Robot, rope_directions_in_body: Array, chosen: Controller) -> Distribution:
    """The layer that shares the load out the way `chosen` plans it. Rope directions (2, 3) at the
    start, body frame.
    """
    return Distribution(Statics(belief.model, belief.machine, rope_directions_in_body), chosen)
