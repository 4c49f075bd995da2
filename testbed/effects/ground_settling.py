"""ground.settling: the ground under one foot gives way."""

from __future__ import annotations

import numpy as np

from testbed.effects.base import Effect, ParameterSpec
from testbed.effects.signature import KNOT_S, RobotSeen, Signature, knots
from testbed.effects.terms import Values
from testbed.machine.names import LEGS


class Settling(Effect):
    """Ground that sinks under a loaded foot at a rate, to a depth."""

    kind = "ground.settling"
    equation = "s = min(rate t, depth), t the time under load"
    text = "one foot stands on scree, mud or a loose block"
    parameters = (
        ParameterSpec("rate", "m/s", 1e-06, 0.1, (0.0001, 0.005), "of the settlement"),
        ParameterSpec("depth", "m", 0.0001, 0.5, (0.005, 0.06), "at which it ends"),
    )
    places = tuple(f"foot_{leg}" for leg in LEGS)
    rigs = ()
    telling_motion = "stand still for minutes with the valves shut"
    alike = {"leakage.internal": "a leak moves the encoder, a sinking foot does not"}
    hides = {"rate": "settling_m_s", "depth": "settling_depth_m"}
    lowest = 0.0
    usual = 5.0e-3

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """How far the foot has sunk at times KNOT_S apart, straight lines between them."""
        leg = self.places.index(place)
        ways = knots(seen.time_s)
        return {f"{index}": seen.moves(leg, -way, 2) for index, way in enumerate(ways.T)}

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """Depth: how far it has sunk at most; rate: of the quickest stretch."""
        sunk = np.array([0.0, *linear.values()])
        return {"rate": float(np.diff(sunk).max()) / KNOT_S, "depth": float(sunk.max())}


EFFECTS = (Settling(),)
