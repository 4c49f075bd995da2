"""inertia.mass: more mass on the rod than declared."""

from __future__ import annotations

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import RobotSeen, Signature
from testbed.effects.terms import ForceTerms, Observed, Signals, Values

LEAST_M_S2 = 0.3
LIGHTER_KG = -40.0
"""What moves with a piston is lighter than drawn by no more than that (E)."""


class AddedMass(Effect):
    """More mass on the rod than declared."""

    kind = "inertia.mass"
    equation = "m = m_declared + mass, in weight and inertia"
    text = "the leg carries more (or less) mass than declared: mud, a tool, a wrong drawing"
    lowest = LIGHTER_KG
    parameters = (
        ParameterSpec("mass", "kg", -1e4, 1e5, (-40.0, 90.0), "added mass"),
        ParameterSpec(
            "weight_share",
            "1",
            0.0,
            1.5,
            (0.0, 1.0),
            "share of it that weighs on the cylinder",
            1.0,
        ),
    )
    shapes = ("weight_share",)
    declared_as = "moving_mass_kg"
    live = {"mass": "extra_mass_kg"}
    telling_motion = "fast sinusoids of a few millimetres in the air, at least 3 m/s2"
    alike = {
        "force.spring": "a spring pulls otherwise at the other end of the travel",
        "sensor.gain_a": "a gain error shows under load, a mass in the air",
    }
    adds = {"mass": "mass_kg"}

    def force(self, signals: Signals, terms: ForceTerms, values: Values) -> None:
        """More weight and more inertia."""
        terms.added_mass_kg += values["mass"]
        terms.weight_mass_kg += values["mass"] * values["weight_share"]

    def unseen(self, observed: Observed) -> str | None:
        """A bench that moves at constant speed shows no mass, declared or not."""
        if observed.kind == "cylinder" and observed.largest_acceleration_m_s2 < LEAST_M_S2:
            return "no acceleration to speak of, and the axis is level"
        return None

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Weight and inertia of what the piston moves."""
        return {"mass": seen.weighs(seen.asked_by_link[:, :, seen.axis(place)])}


EFFECTS = (AddedMass(),)
