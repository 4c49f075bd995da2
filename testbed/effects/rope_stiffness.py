"""rope.stiffness: ropes that are stiffer or softer than declared."""

from __future__ import annotations

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
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
    lowest = -1.0
    usual = 0.5

    def hide(self, world: Hidden, place: str, values: Values) -> None:
        """Of both ropes."""
        world.rope_stiffness_factor *= values["factor"]

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """The pull of held ropes rises otherwise with the body's way."""
        return {"more": Change(ropes=1.0)} if seen.shows_ropes else {}

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """As declared, and more."""
        return {"factor": max(1.0 + linear["more"], self.spec("factor").low)}

    def to_linear(self, values: Values) -> dict[str, float]:
        """What it is more than declared."""
        return {"more": values["factor"] - 1.0}


EFFECTS = (RopeStiffness(),)
