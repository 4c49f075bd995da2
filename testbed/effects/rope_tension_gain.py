"""rope.tension_gain: a load pin that reads a rope's tension wrong."""

from __future__ import annotations

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature, at_point


class TensionGain(Effect):
    """A load pin with another gain and another zero than calibrated."""

    kind = "rope.tension_gain"
    equation = "measured T = (1 + gain_error) T + zero"
    text = "the load pin of a rope is off in gain and zero"
    parameters = (
        ParameterSpec("gain_error", "1", -0.9, 2.0, (-0.1, 0.1), "relative error of the gain"),
        ParameterSpec("zero", "N", -20000.0, 20000.0, (-500.0, 500.0), "reading of a slack rope"),
    )
    places = ("rope_left", "rope_right")
    rigs = ()
    telling_motion = "haul and pay out the rope by a few kilonewtons while standing still"
    alike = {
        "robot.payload": "slack ropes carry nothing, whatever they read",
        "rope.direction": "a wrong direction errs across the rope, a gain along it",
    }
    hides = {"gain_error": "tension_gain_error", "zero": "tension_zero_n"}

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """A pull along the rope that is not there."""
        rope = seen.rope(place)
        way, point = seen.rope_way[:, rope], seen.rope_point_m[rope]
        pull = seen.tension_n[:, rope, None] * way
        return {
            "gain_error": Change(wrench=at_point(pull, point)),
            "zero": Change(wrench=at_point(way, point)),
        }


EFFECTS = (TensionGain(),)
