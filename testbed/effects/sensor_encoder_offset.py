"""sensor.encoder_offset: an encoder whose zero is elsewhere."""

from __future__ import annotations

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.machine.names import AXES


class EncoderOffset(Effect):
    """An encoder that reads a constant too much."""

    kind = "sensor.encoder_offset"
    equation = "measured q = q + offset"
    text = "an encoder was mounted or referenced at another place of the stroke"
    parameters = (
        ParameterSpec("offset", "m or rad", -0.5, 0.5, (-0.02, 0.02), "added to the reading"),
    )
    places = AXES
    rigs = ()
    telling_motion = "drive the joint to both of its ends"
    alike = {"robot.attitude": "an offset moves one foot, a tilted unit all four"}
    adds = {"offset": "encoder_offset"}

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """The foot seems to stand elsewhere: its force acts at another arm, and stance feet seem to
        move.
        """
        axis = seen.axis(place)
        leg, joint = divmod(axis, 3)
        feet = np.zeros_like(seen.foot_m)
        feet[:, leg] = seen.foot_by_joint[:, leg, :, joint]
        return {"offset": Change(balance=seen.missing_by_joint[:, :, axis], feet=feet)}


EFFECTS = (EncoderOffset(),)
