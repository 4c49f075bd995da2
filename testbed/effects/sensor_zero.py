"""sensor.zero_a, sensor.zero_b: a pressure sensor that does not read 0 at no pressure."""

from __future__ import annotations

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import RobotSeen, Signature


class Zero(Effect):
    """What both zeros have in common. On a leg's force a zero is a constant, which diagnosis fits
    in any case.
    """

    parameters = (
        ParameterSpec("zero", "Pa", -2e6, 2e6, (-5e4, 5e4), "reading at no pressure, calibrated"),
    )
    is_tolerance = True
    rigs = ()
    telling_motion = "move a foot in the air, both ways"
    usual = 4.0e5
    """A zero beyond calibration is far beyond."""


class ZeroA(Zero):
    """A pressure sensor A with another zero than calibrated."""

    kind = "sensor.zero_a"
    equation = "measured pA = pA + zero"
    text = "the zero of pressure sensor A is off from the start"
    live = {"zero": "zero_a_pa"}
    alike = {"sensor.drift_a": "a drift grows with time"}
    hides = {"zero": "zero_a_pa"}

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """A constant force."""
        axis = seen.axis(place)
        return {"zero": seen.reads(axis, 0, np.ones(seen.bins))}


class ZeroB(Zero):
    """The zero of pressure sensor B."""

    kind = "sensor.zero_b"
    equation = "measured pB = pB + zero"
    text = "the zero of pressure sensor B is off from the start"
    live = {"zero": "zero_b_pa"}
    hides = {"zero": "zero_b_pa"}

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """A constant force."""
        axis = seen.axis(place)
        return {"zero": seen.reads(axis, 1, np.ones(seen.bins))}


EFFECTS = (ZeroA(), ZeroB())
