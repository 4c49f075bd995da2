"""robot.payload: an undeclared mass on the body."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import RobotSeen, Signature
from testbed.effects.terms import Hidden, HiddenMass, Values
from testbed.formats.arrays import Array
from testbed.machine.scale import Scale

LEAST_KG = 90.0
"""What any workshop leaves on a platform or takes off it is no payload (workshop.yaml)."""
FURTHEST_M = 1.2
"""From the body's origin, along each axis (E)."""


class HiddenPayload(Effect):
    """A point mass fixed to the body."""

    kind = "robot.payload"
    equation = "a mass at (x, y, z) of the body frame, in weight and inertia"
    text = "something heavy lies on the platform: rods, tools, mud, snow"
    parameters = (
        ParameterSpec(
            "mass",
            "kg",
            -500.0,
            2000.0,
            (20.0, 400.0),
            "of the payload; negative: lighter than drawn",
        ),
        ParameterSpec("x", "m", -3.0, 3.0, (-1.0, 1.0), "forward, body frame"),
        ParameterSpec("y", "m", -3.0, 3.0, (-1.0, 1.0), "to the left"),
        ParameterSpec("z", "m", -2.0, 3.0, (0.0, 0.6), "upward"),
    )
    places = ("body",)
    rigs = ()
    telling_motion = "stand level, then pitched and rolled by a few degrees with the same ropes"
    alike = {
        "robot.centre_of_mass": "a mass adds to the sum of the foot loads, a shifted centre does not",
        "rope.tension_gain": "slack ropes carry nothing, whatever they read",
    }

    def hide(self, world: Hidden, place: str, values: Values) -> None:
        """One more mass on the body."""
        point = (values["x"], values["y"], values["z"])
        world.body_masses.append(HiddenMass(values["mass"], point))

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Weight and inertia at a point, which is linear in the mass and in its first moments."""
        names = ("mass", "mass x", "mass y", "mass z")
        return {
            name: seen.weighs(seen.asked_by_moment[:, :, index]) for index, name in enumerate(names)
        }

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """First moments over the mass are its place."""
        mass = linear["mass"]
        at = {axis: linear[f"mass {axis}"] / mass if mass else 0.0 for axis in "xyz"}
        return {"mass": mass, **at}

    def to_linear(self, values: Values) -> dict[str, float]:
        """The mass and its first moments."""
        mass = values["mass"]
        return {"mass": mass, **{f"mass {axis}": mass * values[axis] for axis in "xyz"}}

    def possible(self, numbers: Mapping[str, Array], scale: Scale) -> npt.NDArray[np.bool_]:
        """It weighs more than what every machine carries, and lies on the machine: moments of a
        mass that is none are those of a shifted centre.
        """
        mass = numbers["mass"]
        most = FURTHEST_M * scale.length * np.abs(mass)
        inside = [np.abs(numbers[f"mass {axis}"]) <= most for axis in "xyz"]
        return np.asarray(np.all([mass > LEAST_KG * scale.times("kg"), *inside], axis=0))

    def spread(self, number: str) -> float:
        """A quarter of a ton, most of it near the middle."""
        return {"mass": 250.0, "mass z": 80.0}.get(number, 150.0)


EFFECTS = (HiddenPayload(),)
