"""leakage.internal: oil that passes the piston."""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import FlowTerms, Observed, Signals, Values

REFERENCE_PA = 1e6
"""Pressure drop at which the flow is `coefficient` times the drop, whatever the exponent."""


def flow_m3_s(drop_pa: Any, coefficient: float, exponent: float = 1.0) -> Any:
    """Flow from A to B for drop pA - pB; exponent 0.5 is an orifice, 1 a gap (the contract's
    formula).
    """
    if exponent == 1.0:
        return coefficient * drop_pa
    return coefficient * REFERENCE_PA * np.sign(drop_pa) * (abs(drop_pa) / REFERENCE_PA) ** exponent


class Leakage(Effect):
    """Oil that passes the piston."""

    kind = "leakage.internal"
    equation = "q_AB = coefficient (pA - pB), larger than declared"
    text = "oil passes the piston: a worn seal, a scored bore"
    parameters = (
        ParameterSpec(
            "coefficient", "m3/(s Pa)", 0.0, 1e-9, (2e-13, 1e-11), "whole leakage of the piston"
        ),
        ParameterSpec(
            "exponent", "1", 0.4, 1.6, (0.5, 1.0), "power of the drop, 1 at 10 bar", 1.0, log=True
        ),
    )
    needs = ("position", "pressure_a", "pressure_b", "valve_command")
    rigs = ("vertical-leg",)
    seen_in = ("flow",)
    shapes = ("exponent",)
    declared_as = "internal_leakage_m3_s_pa"
    telling_motion = "hold a load with the valve shut and watch the piston sink"
    alike = {"valve.deadband": "a deadband shows at small openings only"}
    adds = {"coefficient": "inner_leakage"}
    usual = 3.0e-12

    def flow(self, signals: Signals, terms: FlowTerms, values: Values) -> None:
        """The whole leakage is this one's."""
        terms.leakage_m3_s_pa = values["coefficient"]
        terms.leakage_exponent = values["exponent"]

    def starts(self, observed: Observed) -> list[dict[str, float]]:
        """A little more than declared."""
        more = 2e-13 * observed.size("m3/(s Pa)")
        return [{"coefficient": (observed.known.internal_leakage_m3_s_pa or 0.0) + more}]

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Oil from A to B."""
        axis = seen.axis(place)
        return {"coefficient": Change(oil={axis: seen.oil_by_leak[:, axis]})}


EFFECTS = (Leakage(),)
