"""leg.hinge: a leg that hangs on the body elsewhere than drawn."""

from __future__ import annotations

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.terms import Hidden, Values
from testbed.machine.names import LEGS


class Hinge(Effect):
    """A shifted axis of a leg's rotation joint; all that hangs on it shifts with it."""

    kind = "leg.hinge"
    equation = "hip = hip_declared + (x, y, z), body frame"
    text = "the bearings of a leg were welded and bored a little elsewhere"
    parameters = (
        ParameterSpec("x", "m", -0.1, 0.1, (-5e-3, 5e-3), "forward, body frame"),
        ParameterSpec("y", "m", -0.1, 0.1, (-5e-3, 5e-3), "to the left"),
        ParameterSpec("z", "m", -0.1, 0.1, (-5e-3, 5e-3), "upward"),
    )
    places = LEGS
    rigs = ()
    telling_motion = "let each foot touch level ground by itself"
    alike = {"sensor.encoder_offset": "the height is an offset of the vertical joint's encoder"}

    def hide(self, world: Hidden, place: str, values: Values) -> None:
        """Of this leg."""
        world.hinges_m[place] = (values["x"], values["y"], values["z"])


EFFECTS = (Hinge(),)
