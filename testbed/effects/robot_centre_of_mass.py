"""robot.centre_of_mass: the body's centre of mass lies elsewhere than drawn."""

from __future__ import annotations

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import RobotSeen, Signature
from testbed.effects.terms import Hidden, Values


class CentreOfMass(Effect):
    """A shifted centre of mass of the link `body`; its mass and its inertia about it stay."""

    kind = "robot.centre_of_mass"
    equation = "c = c_declared + (x, y, z), body frame"
    text = "the body's centre of mass is not where the drawing has it"
    parameters = (
        ParameterSpec("x", "m", -1.0, 1.0, (-0.15, 0.15), "forward, body frame"),
        ParameterSpec("y", "m", -1.0, 1.0, (-0.15, 0.15), "to the left"),
        ParameterSpec("z", "m", -1.0, 1.0, (-0.15, 0.15), "upward"),
    )
    places = ("body",)
    rigs = ()
    telling_motion = "stand level, then pitched and rolled by a few degrees with slack ropes"
    alike = {
        "robot.payload": "a mass adds to the sum of the foot loads, a shifted centre does not",
        "robot.attitude": "a tilted unit shows in the direction of gravity at rest, whatever the posture",
    }

    def hide(self, world: Hidden, place: str, values: Values) -> None:
        """On top of a shift that is there."""
        x, y, z = world.centre_of_mass_m
        world.centre_of_mass_m = (x + values["x"], y + values["y"], z + values["z"])

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """First moments of the body's mass."""
        moments = seen.body_mass_kg * seen.asked_by_moment[:, :, 1:]
        return {name: seen.weighs(moments[:, :, index]) for index, name in enumerate("xyz")}


EFFECTS = (CentreOfMass(),)
