"""drill.thrust: a feed that pushes otherwise than ordered."""

from __future__ import annotations

from testbed.effects.base import Effect, ParameterSpec
from testbed.effects.hidden import Hidden
from testbed.effects.terms import Values


class Thrust(Effect):
    """A thrust that is a multiple of the ordered one."""

    kind = "drill.thrust"
    equation = "thrust = factor (ordered thrust)"
    text = "the feed's pressure and its thrust are not what its controls take them for"
    parameters = (ParameterSpec("factor", "1", 0.0, 3.0, (0.7, 1.3), "of the ordered thrust"),)
    places = ("drill",)
    rigs = ()
    telling_motion = "order thrust in steps against firm rock while standing still"
    alike = {"robot.payload": "a payload is there without thrust"}

    def hide(self, world: Hidden, place: str, values: Values) -> None:
        """Of the one feed."""
        world.thrust_factor *= values["factor"]


EFFECTS = (Thrust(),)
