"""ground.friction: another friction under one foot."""

from __future__ import annotations

import numpy as np

from testbed.effects.base import Effect, ParameterSpec
from testbed.effects.signature import KNOT_S, RobotSeen, Signature, knots
from testbed.effects.terms import Values
from testbed.machine.names import LEGS


class GroundFriction(Effect):
    """Another coefficient of friction between one foot and its ground."""

    kind = "ground.friction"
    equation = "|F_t| <= coefficient F_n under this foot"
    text = "one foot stands on wet, icy or polished rock"
    parameters = (
        ParameterSpec("coefficient", "1", 0.02, 2.0, (0.1, 0.5), "in place of the declared one"),
    )
    places = tuple(f"foot_{leg}" for leg in LEGS)
    rigs = ()
    telling_motion = "shift the body sideways until the foot slips"
    hides = {"coefficient": "friction"}
    usual = 5.0e-3

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """How far the foot has slipped up the slope and to the left at times KNOT_S apart."""
        leg = self.places.index(place)
        ways = knots(seen.time_s)
        return {
            f"{axis} {index}": seen.moves(leg, way, axis)
            for axis in (0, 1)
            for index, way in enumerate(ways.T)
        }

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """What friction the foot used while it slipped."""
        leg = self.places.index(place)
        slipped = np.array(list(linear.values())).reshape(2, -1)
        speed = np.linalg.norm(np.diff(slipped, axis=1, prepend=0.0), axis=0) / KNOT_S
        stretch = np.minimum(seen.time_s // KNOT_S, len(speed) - 1).astype(int)
        use = seen.friction_use[:, leg][speed[stretch] >= 0.5 * speed.max()]
        return {"coefficient": float(np.median(use))}


EFFECTS = (GroundFriction(),)
