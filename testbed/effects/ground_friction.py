"""ground.friction: another friction under one foot."""

from __future__ import annotations

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import KNOT_S, RobotSeen, Signature
from testbed.effects.terms import Values
from testbed.machine.names import LEGS, VERTICAL

BEARS = 0.25
"""A foot bears from this share of its usual load on (E)."""
MOST_USED, UNSURE, UNSURE_SHARE = 0.9, 0.15, 0.3
"""All the friction that a foot has is what it uses at this quantile of its time on the ground; use
is known to this, or to this share of it (E).
"""


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
        """How far the foot slips up the slope and to the left within each KNOT_S: only while it
        uses all the friction that it has.
        """
        leg = self.places.index(place)
        use, load_n = seen.friction_use[:, leg], np.abs(seen.load_n[:, VERTICAL[leg]])
        bears = load_n > BEARS * np.median(load_n)
        most = float(np.quantile(use[bears], MOST_USED))
        slips = bears & (use > most - max(UNSURE, UNSURE_SHARE * most))
        stretch = seen.time_s // KNOT_S
        ways = [np.cumsum(slips & (stretch == k)) for k in range(int(stretch[-1]) + 1)]
        return {
            f"{axis} {index}": seen.moves(leg, way / max(way[-1], 1), axis)
            for axis in (0, 1)
            for index, way in enumerate(ways)
        }

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """What friction the foot used while it slipped."""
        leg = self.places.index(place)
        speed = np.linalg.norm(np.array(list(linear.values())).reshape(2, -1), axis=0) / KNOT_S
        stretch = np.minimum(seen.time_s // KNOT_S, len(speed) - 1).astype(int)
        use = seen.friction_use[:, leg][speed[stretch] >= 0.5 * speed.max()]
        return {"coefficient": float(np.median(use))}


EFFECTS = (GroundFriction(),)
