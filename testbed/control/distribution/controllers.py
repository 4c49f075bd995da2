"""The force-distributing controllers by name: one line each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from testbed.control.distribution.distribution import Distribution, Sharing
from testbed.control.distribution.drill_sharing import DrillSharing
from testbed.control.distribution.learned import Learned
from testbed.control.distribution.position_hold import PositionHold
from testbed.control.distribution.pseudo_inverse import PseudoInverse
from testbed.control.distribution.quadratic import Quadratic
from testbed.control.distribution.statics import Statics
from testbed.control.programs.references import Program
from testbed.errors import InputError
from testbed.formats.sockets import FORM, is_user_class, load_object
from testbed.robot.robot import Robot

Array = NDArray[np.float64]
CONTROLLERS: dict[str, Callable[[], Sharing]] = {
    "position_hold": PositionHold,
    "pseudo_inverse": PseudoInverse,
    "qp": Quadratic,
    "drill": DrillSharing,
    "learned": Learned,
}


def controller(name: str) -> Sharing:
    """A fresh controller: a name of the table, `FILE.py:Class` for one of your own, or a trained `policy.npz`.

    Raises InputError with the names there are.
    """
    if name in CONTROLLERS:
        return CONTROLLERS[name]()
    if name.endswith(".npz"):
        return Learned(Path(name))
    if is_user_class(name):
        own: Sharing = load_object(name, Sharing, field="controller")
        return own
    allowed = f"{', '.join(CONTROLLERS)}, {FORM} or policy.npz"
    raise InputError("no such controller", field="controller", value=name, allowed=allowed)


def distributed(
    belief: Robot, inner: Program, rope_directions_in_body: Array, sharing: Sharing
) -> Distribution:
    """The inner program with its load shared out by `sharing`. Rope directions (2, 3) at the start, body frame."""
    statics = Statics(belief.model, belief.machine, rope_directions_in_body)
    return Distribution(inner, statics, sharing)
