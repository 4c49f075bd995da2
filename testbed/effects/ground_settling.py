"""ground.settling: the ground under one foot gives way."""

from __future__ import annotations

from testbed.effects.base import Effect, ParameterSpec
from testbed.effects.hidden import Hidden
from testbed.effects.terms import Values
from testbed.machine.names import LEGS


class Settling(Effect):
    """Ground that sinks under a loaded foot at a rate, to a depth."""

    kind = "ground.settling"
    equation = "s = min(rate t, depth), t the time under load"
    text = "one foot stands on scree, mud or a loose block"
    parameters = (
        ParameterSpec("rate", "m/s", 1e-06, 0.1, (0.0001, 0.005), "of the settlement"),
        ParameterSpec("depth", "m", 0.0001, 0.5, (0.005, 0.06), "at which it ends"),
    )
    places = tuple(f"foot_{leg}" for leg in LEGS)
    rigs = ()
    telling_motion = "stand still for minutes with the valves shut"
    alike = {"leakage.internal": "a leak moves the encoder, a sinking foot does not"}

    def hide(self, world: Hidden, place: str, values: Values) -> None:
        """Under this foot, wherever it stands."""
        foot = world.feet[place]
        foot.settling_m_s, foot.settling_depth_m = values["rate"], values["depth"]


EFFECTS = (Settling(),)
