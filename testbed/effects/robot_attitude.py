"""robot.attitude: the inertial unit is not mounted as drawn."""

from __future__ import annotations

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import RobotSeen, Signature


class Attitude(Effect):
    """An inertial unit that is turned against the body."""

    kind = "robot.attitude"
    equation = "measured roll = roll + roll error, measured pitch = pitch + pitch error"
    text = "the inertial unit sits askew: a bent bracket, a mounting that was not levelled"
    parameters = (
        ParameterSpec("roll", "rad", -0.5, 0.5, (-0.05, 0.05), "added to the roll that it reads"),
        ParameterSpec("pitch", "rad", -0.5, 0.5, (-0.05, 0.05), "added to the pitch"),
    )
    places = ("body",)
    rigs = ()
    telling_motion = "stand on ground of known slope with slack ropes, turned by half a circle"
    alike = {"robot.centre_of_mass": "a tilted unit shows in the direction of gravity at rest"}
    adds = {"roll": "unit_roll_rad", "pitch": "unit_pitch_rad"}

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Weight in another direction, ropes in another."""
        return {name: seen.tilted(index) for index, name in enumerate(("roll", "pitch"))}


EFFECTS = (Attitude(),)
