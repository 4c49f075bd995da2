"""drill.thrust: a feed that pushes otherwise than ordered."""

from __future__ import annotations

import math

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature, at_point
from testbed.effects.terms import Hidden, Values


class Thrust(Effect):
    """A thrust that is a multiple of the ordered one."""

    kind = "drill.thrust"
    equation = "thrust = factor (ordered thrust)"
    text = "the feed's pressure and its thrust are not what its controls take them for"
    parameters = (ParameterSpec("factor", "1", 0.0, 3.0, (0.7, 1.3), "of the ordered thrust"),)
    places = ("drill",)
    rigs = ()
    telling_motion = "order thrust in steps against firm rock while standing still"
    alike = {"robot.payload": "a payload is there without thrust"}
    lowest = -math.inf
    usual = 0.35

    def hide(self, world: Hidden, place: str, values: Values) -> None:
        """Of the one feed."""
        world.thrust_factor *= values["factor"]

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """More thrust along the drill than ordered."""
        thrust = np.outer(seen.thrust_n, [0.0, 0.0, 1.0])
        return {"factor": Change(wrench=-at_point(thrust, seen.drill_point_m))}

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """The number of the signature is what the factor differs from 1 by."""
        return {"factor": 1.0 + linear["factor"]}

    def to_linear(self, values: Values) -> dict[str, float]:
        """What the factor differs from 1 by."""
        return {"factor": values["factor"] - 1.0}


EFFECTS = (Thrust(),)
