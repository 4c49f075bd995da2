"""rope.attachment: a rope that pulls at another height than drawn."""

from __future__ import annotations

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature


class RopeAttachment(Effect):
    """A rope that leaves its sheave higher or lower on the body."""

    kind = "rope.attachment"
    equation = "attachment = attachment_declared + (0, 0, height), body frame"
    text = "the sheave sits elsewhere than drawn, or the rope runs up its flank"
    parameters = (ParameterSpec("height", "m", -0.3, 0.3, (-0.03, 0.03), "upward"),)
    places = ("rope_left", "rope_right")
    is_tolerance = True
    rigs = ()
    telling_motion = "haul and pay out both ropes by a few kilonewtons while standing still"
    alike = {"rope.direction": "a wrong direction moves forces, a wrong height moments alone"}
    adds = {"height": "attachment_height_m"}
    usual = 0.12  # far beyond a workshop's tolerance, as for the zeros of sensors

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """The same pull at another height."""
        rope = seen.rope(place)
        pull = seen.tension_n[:, rope, None] * seen.rope_way[:, rope]
        moment = np.cross(np.array([0.0, 0.0, 1.0]), pull)
        return {"height": Change(wrench=-np.hstack([np.zeros_like(pull), moment]))}


EFFECTS = (RopeAttachment(),)
