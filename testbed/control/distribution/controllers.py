"""The force-distributing controllers by name: one line each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from testbed.control.distribution.distribution import Controller, Distribution
from testbed.control.distribution.drill_sharing import DrillSharing
from testbed.control.distribution.learned import Learned
from testbed.control.distribution.position_hold import PositionHold
from testbed.control.distribution.pseudo_inverse import PseudoInverse
from testbed.control.distribution.quadratic import Quadratic
from testbed.control.distribution.statics import Statics
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.sockets import FORM, is_user_class, load_object
from testbed.robot.robot import Robot

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
