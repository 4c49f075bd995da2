"""supply.pump: a pump that gives less than its plate says."""

from __future__ import annotations

import math

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import Hidden, Values


class Pump(Effect):
    """Another full flow and another set pressure of the pump."""

    kind = "supply.pump"
    equation = "full flow = flow_factor (declared), set pressure = pressure_factor (declared)"
    text = "the pump is worn, its compensator set otherwise"
    parameters = (
        ParameterSpec("flow_factor", "1", 0.0, 2.0, (0.5, 1.0), "of the declared full flow"),
        ParameterSpec("pressure_factor", "1", 0.1, 1.5, (0.8, 1.0), "of the declared set pressure"),
    )
    places = ("supply",)
    rigs = ()
    looked_for = 70.0
    telling_motion = "all four vertical joints at full speed together, then a minute of rest"
    alike = {"supply.droop": "a droop passes with the flow, a lower set pressure stays"}
    lowest = -math.inf
    usual = 0.25

    def hide(self, world: Hidden, place: str, values: Values) -> None:
        """Of the one power unit."""
        world.pump_flow_factor *= values["flow_factor"]
        world.pump_pressure_factor *= values["pressure_factor"]

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """A supply that stands lower, and one that gives way while much oil is drawn."""
        return {
            "pressure_factor": Change(supply=-seen.supply_by_pressure),
            "flow_factor": Change(supply=-seen.supply_by_flow),
        }

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """The numbers of the signature are what the factors differ from 1 by."""
        return {name: 1.0 + off for name, off in linear.items()}

    def to_linear(self, values: Values) -> dict[str, float]:
        """What the factors differ from 1 by."""
        return {name: value - 1.0 for name, value in values.items()}


EFFECTS = (Pump(),)
