"""sensor.linearity: pressure sensors whose characteristic is bowed."""

from __future__ import annotations

from testbed.effects.base import Effect, ParameterSpec


class Linearity(Effect):
    """A parabola through both ends of the range."""

    kind = "sensor.linearity"
    equation = "measured p = p + 4 bow (p / range) (1 - p / range)"
    text = "both pressure sensors of a cylinder read true at the ends of their range alone"
    parameters = (
        ParameterSpec("bow", "Pa", -1e6, 1e6, (-2.5e4, 2.5e4), "error in the middle of the range"),
    )
    rigs = ()
    telling_motion = "press at rising loads up to the whole range"
    alike = {"sensor.gain_a": "a gain error goes on growing with the pressure"}
    hides = {"bow": "bow_pa"}


EFFECTS = (Linearity(),)
