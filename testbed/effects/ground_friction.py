"""ground.friction: another friction under one foot."""

from __future__ import annotations

from testbed.effects.base import Effect, ParameterSpec
from testbed.effects.hidden import Hidden
from testbed.effects.terms import Values
from testbed.machine.names import LEGS


class GroundFriction(Effect):
    """Another coefficient of friction between one foot and its ground."""

    kind = "ground.friction"
    equation = "|F_t| <= coefficient F_n under this foot"
    text = "one foot stands on wet, icy or polished rock"
    parameters = (
        ParameterSpec("coefficient", "1", 0.02, 2.0, (0.1, 0.5), "in place of the declared one"),
    )
    places = tuple(f"foot_{leg}" for leg in LEGS)
    rigs = ()
    telling_motion = "shift the body sideways until the foot slips"

    def hide(self, world: Hidden, place: str, values: Values) -> None:
        """Under this foot, wherever it stands."""
        world.feet[place].friction = values["coefficient"]


EFFECTS = (GroundFriction(),)
