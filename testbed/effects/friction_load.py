"""friction.load: guides that are pressed by the foot's load."""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.friction_pressure import not_less_than_none
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import Coordinate, ForceTerms, Observed, Signals, Values

LEAST_LOAD_N = 50.0
"""A recording whose largest load is smaller shows nothing of it (E)."""

REFERENCE_LOAD_N = 1e4
"""At this load the exponent changes nothing."""


def coulomb_increase_n(external_force_n: Any, coefficient: float, exponent: float = 1.0) -> Any:
    """Added Coulomb force in N for an external force in N, positive when the ground pushes the foot
    up.
    """
    load = 0.5 * (external_force_n + abs(external_force_n))
    return coefficient * REFERENCE_LOAD_N * (load / REFERENCE_LOAD_N) ** exponent


class LoadFriction(Effect):
    """Guides that are pressed by the foot's load."""

    kind = "friction.load"
    equation = "F_c = F_c0 + coefficient max(F_ext, 0)"
    text = "the Coulomb term grows with the foot's load: side forces in the guides"
    parameters = (
        ParameterSpec("coefficient", "1", -0.5, 0.9, (0.01, 0.1), "added Coulomb force per load"),
        ParameterSpec(
            "exponent", "1", 0.2, 4.0, (0.5, 2.0), "power of the load, 1 at 10 kN", 1.0, log=True
        ),
    )
    shapes = ("exponent",)
    live = {"coefficient": "load_coefficient"}
    telling_motion = "press on the load cell at rising loads and slide a few millimetres under each"
    alike = {
        "friction.pressure": "the same load at two supply pressures: only the seals feel the difference",
        "sensor.gain_a": "a gain error has the same sign both ways, friction has not",
    }
    adds = {"coefficient": "seal.load_coefficient"}

    def force(self, signals: Signals, terms: ForceTerms, values: Values) -> None:
        """The Coulomb term grows with the force that is sought."""
        terms.load_coefficient += values["coefficient"]
        terms.load_exponent = values["exponent"]

    def unseen(self, observed: Observed) -> str | None:
        """Without load there is nothing to see."""
        if observed.largest_load_n < LEAST_LOAD_N:
            return "no recording with load: the foot is always in the air"
        return None

    def starts(self, observed: Observed) -> list[dict[str, float]]:
        """A little of it."""
        return [{"coefficient": 1e-3}]

    def narrowed(self, coordinate: Coordinate, observed: Observed) -> Coordinate:
        """See `friction_pressure.not_less_than_none`."""
        return not_less_than_none(coordinate)

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Dry friction that grows with the load that pushes the rod in."""
        axis = seen.axis(place)
        pushed = np.maximum(seen.load_n[:, axis], 0.0)
        return {"coefficient": Change(force={axis: seen.direction[:, axis] * pushed})}


EFFECTS = (LoadFriction(),)
