"""force.spring: something elastic that holds the piston."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import Coordinate, ForceTerms, Observed, Signals, Values


def force_n(position_m: Any, stiffness: float, rest: float, cubic: float = 0.0) -> Any:
    """Force on the piston along extension, N; cubic (N/m3) is 0 in the contract's formula."""
    stretch = position_m - rest
    return -stretch * (stiffness + cubic * stretch * stretch)


class Spring(Effect):
    """Something elastic that holds the piston."""

    kind = "force.spring"
    equation = "F = -stiffness (x - rest) on the piston"
    text = "an undeclared spring on the piston: a hose, a bellows, a balancing spring"
    parameters = (
        ParameterSpec("stiffness", "N/m", -1e6, 1e7, (300.0, 6000.0), "force per travel"),
        ParameterSpec("rest", "m", -20.0, 20.0, (0.05, 0.45), "where it pulls nothing"),
        ParameterSpec("cubic", "N/m3", -1e8, 1e8, (-2e4, 2e4), "hardening", 0.0),
    )
    shapes = ("cubic",)
    live = {"stiffness": "spring_stiffness_n_m", "rest": "spring_rest_m"}
    telling_motion = "stops along the whole travel, approached from both sides"
    alike = {
        "force.cushion": "a cushion ends at its start, a spring pulls beyond its rest",
        "inertia.mass": "a mass weighs the same along the travel, a spring does not",
        "sensor.gain_a": "a gain error grows with the pressure, wherever the piston is",
    }
    hides = {"stiffness": "extra.spring_stiffness", "rest": "extra.spring_rest"}

    def force(self, signals: Signals, terms: ForceTerms, values: Values) -> None:
        """It pulls the piston to where it rests."""
        terms.force_n = terms.force_n + force_n(
            signals.position_m, values["stiffness"], values["rest"], values["cubic"]
        )

    def starts(self, observed: Observed) -> list[dict[str, float]]:
        """A weak one that rests in the middle of the travel."""
        low, high = np.percentile(observed.position_m, [5, 95])
        return [{"stiffness": 50.0 * observed.size("N/m"), "rest": float(0.5 * (low + high))}]

    def narrowed(self, coordinate: Coordinate, observed: Observed) -> Coordinate:
        """It rests near the travel."""
        if coordinate.name != "rest":
            return coordinate
        low, high = float(observed.position_m.min()), float(observed.position_m.max())
        span = max(high - low, 1e-3)
        return replace(
            coordinate,
            low=low - 2 * span,
            high=high + 2 * span,
            scale=0.3 * span,
            prior=(0.5 * (low + high), 1.5 * span),
        )

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """A force against extension, and what its rest makes a constant."""
        axis = seen.axis(place)
        return {
            "stiffness": Change(force={axis: seen.extension_m[:, axis]}),
            "stiffness rest": Change(force={axis: -np.ones(seen.bins)}),
        }

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """The constant over the stiffness is the rest."""
        stiffness = linear["stiffness"]
        rest = linear["stiffness rest"] / stiffness if stiffness else 0.0
        return {"stiffness": stiffness, "rest": rest}

    def to_linear(self, values: Values) -> dict[str, float]:
        """The stiffness, and the constant that its rest makes."""
        stiffness = values["stiffness"]
        return {"stiffness": stiffness, "stiffness rest": stiffness * values["rest"]}

    def spread(self, number: str) -> float:
        """See Effect; the constant goes with the stiffness over half a stroke."""
        return 6000.0 if number == "stiffness rest" else 2.0e4


EFFECTS = (Spring(),)
