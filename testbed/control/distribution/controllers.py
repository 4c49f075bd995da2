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
    """A fresh controller: a name of the table, `file.py:Class` for one of your own, or a trained `policy.npz`.

    Raises InputError with the names there are.
    """
    if name in CONTROLLERS:
        return CONTROLLERS[name]()
    if name.endswith(".npz"):
        return Learned(Path(name))
    file, colon, made = name.rpartition(":")
    if not colon or not file.endswith(".py"):
        allowed = f"{', '.join(CONTROLLERS)}, file.py:Class or policy.npz"
        raise InputError("no such controller", field="controller", value=name, allowed=allowed)
    return _own(Path(file), made)


def _own(file: Path, made: str) -> Sharing:
    import importlib.util

    spec = importlib.util.spec_from_file_location(file.stem, file) if file.is_file() else None
    if spec is None or spec.loader is None:
        raise InputError("no such file", file=file, field="controller", allowed="file.py:Class")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if not hasattr(getattr(module, made, None), "plan"):
        raise InputError(
            "has no such class with a method plan", file=file, field="controller", value=made
        )
    own: Sharing = getattr(module, made)()
    return own


def distributed(
    belief: Robot, inner: Program, rope_directions_in_body: Array, sharing: Sharing
) -> Distribution:
    """The inner program with its load shared out by `sharing`. Rope directions (2, 3) at the start, body frame."""
    statics = Statics(belief.model, belief.machine, rope_directions_in_body)
    return Distribution(inner, statics, sharing)
