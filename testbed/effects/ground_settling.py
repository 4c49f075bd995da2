"""ground.settling: the ground under one foot gives way."""

from __future__ import annotations

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import RobotSeen, Signature
from testbed.effects.terms import Values
from testbed.machine.names import LEGS

ENDS_S = (3.0, 8.0, 20.0, 60.0)
"""Times under load at which the sinking may end."""


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
    usual = 1.0e-3

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """How far the foot has sunk: at an even rate until each of ENDS_S, and no further."""
        leg = self.places.index(place)
        return {
            f"rate {end:g}": seen.moves(leg, -np.minimum(seen.time_s, end), 2) for end in ENDS_S
        }

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """Depth: where it ends, which a foot that still sinks does not tell; rate: while all of it
        sinks.
        """
        rates = np.array(list(linear.values()))
        return {"rate": float(rates.sum()), "depth": float(rates @ ENDS_S)}


EFFECTS = (Settling(),)
