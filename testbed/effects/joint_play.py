"""joint.play: a joint that follows its lever with play."""

from __future__ import annotations

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.machine.names import AXES


class Play(Effect):
    """A backlash between a rotation joint and the lever on which its encoder sits."""

    kind = "joint.play"
    equation = "measured q stays where it is until q is further away than half_width"
    text = "the pins of a rotation joint's lever are worn"
    parameters = (ParameterSpec("half_width", "rad", 0.0, 0.05, (1e-3, 1e-2), "of the play"),)
    places = tuple(axis for axis in AXES if axis.endswith("_rotation"))
    rigs = ()
    telling_motion = "turn the leg to and fro with its foot in the air"
    alike = {"sensor.encoder_offset": "an offset stays when the leg turns back, play changes sides"}
    hides = {"half_width": "play_rad"}


EFFECTS = (Play(),)
