"""sensor.hysteresis: pressure sensors that show less than they have come from."""

from __future__ import annotations

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec


class Hysteresis(Effect):
    """A backlash between the pressure and what both sensors of a cylinder show."""

    kind = "sensor.hysteresis"
    equation = "measured p stays where it is until p is further away than width"
    text = "the diaphragms of both pressure sensors of a cylinder stick or creep"
    parameters = (
        ParameterSpec("width", "Pa", 0.0, 1e6, (2e3, 2.5e4), "half the width of the loop"),
    )
    rigs = ()
    telling_motion = "raise the load in steps and lower it by the same ones"
    alike = {
        "friction.pressure": "friction changes with motion, hysteresis with the pressure's way"
    }
    hides = {"width": "hysteresis_pa"}


EFFECTS = (Hysteresis(),)
