"""rope.stiffness: ropes that are stiffer or softer than declared."""

from __future__ import annotations

from testbed.effects.base import Effect, ParameterSpec
from testbed.effects.terms import Hidden, Values


class RopeStiffness(Effect):
    """Another EA of both ropes."""

    kind = "rope.stiffness"
    equation = "EA = factor EA_declared"
    text = "the ropes are of another make, wet or worn"
    parameters = (ParameterSpec("factor", "1", 0.05, 20.0, (0.5, 2.0), "of the declared EA"),)
    places = ("rope",)
    rigs = ()
    telling_motion = "sway up and down the slope with the traction devices held"

    def hide(self, world: Hidden, place: str, values: Values) -> None:
        """Of both ropes."""
        world.rope_stiffness_factor *= values["factor"]


EFFECTS = (RopeStiffness(),)
