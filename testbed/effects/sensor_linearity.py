"""sensor.linearity: pressure sensors whose characteristic is bowed."""

from __future__ import annotations

from typing import Any

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import RobotSeen, Signature


def bowed(pressure_pa: Any, range_pa: float) -> Any:
    """What a sensor reads too much at a gauge pressure, for 1 Pa in the middle of its range."""
    share = pressure_pa / range_pa
    return 4.0 * share * (1.0 - share)


class Linearity(Effect):
    """A parabola through both ends of the range."""

    kind = "sensor.linearity"
    equation = "measured p = p + 4 bow (p / range) (1 - p / range)"
    text = "both pressure sensors of a cylinder read true at the ends of their range alone"
    parameters = (
        ParameterSpec("bow", "Pa", -1e6, 1e6, (-2.5e4, 2.5e4), "error in the middle of the range"),
    )
    is_tolerance = True
    rigs = ()
    telling_motion = "press at rising loads up to the whole range"
    alike = {"sensor.gain_a": "a gain error goes on growing with the pressure"}
    hides = {"bow": "bow_pa"}
    usual = 4.0e5
    """A bow beyond a data sheet's is far beyond, as for zeros."""

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """What both sensors read too much by a bow, at the pressures that they read."""
        axis = seen.axis(place)
        pressures, range_pa = seen.pressures_pa(axis), float(seen.pressure_range_pa[axis])
        return {"bow": seen.both_read(axis, bowed(pressures, range_pa))}


EFFECTS = (Linearity(),)
