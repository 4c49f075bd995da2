"""rope.direction: an anchor that is elsewhere than surveyed."""

from __future__ import annotations

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature, at_point


class RopeDirection(Effect):
    """An anchor seen from the robot in another direction, at the same distance."""

    kind = "rope.direction"
    equation = (
        "the direction of the rope, turned to the left by azimuth and off the slope by elevation"
    )
    text = "a rope's anchor is not where it was surveyed, or the rope bends round a rock"
    parameters = (
        ParameterSpec(
            "azimuth", "rad", -0.8, 0.8, (-0.1, 0.1), "to the left, in the slope's plane"
        ),
        ParameterSpec("elevation", "rad", -0.8, 0.8, (-0.1, 0.1), "off the slope"),
    )
    places = ("rope_left", "rope_right")
    rigs = ()
    telling_motion = "haul one rope and then the other by a few kilonewtons while standing still"
    alike = {"rope.tension_gain": "a wrong direction errs across the rope, a gain along it"}
    hides = {"azimuth": "azimuth_rad", "elevation": "elevation_rad"}

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """The pull turned out of its direction."""
        rope = seen.rope(place)
        pull = seen.tension_n[:, rope, None] * seen.rope_way[:, rope]
        off = seen.slope_frame[:, 2]
        aside = np.cross(off, pull)
        up = np.linalg.norm(pull, axis=1)[:, None] * off
        point = seen.rope_point_m[rope]
        return {
            "azimuth": Change(wrench=-at_point(aside, point)),
            "elevation": Change(wrench=-at_point(up, point)),
        }


EFFECTS = (RopeDirection(),)
