"""friction.temperature: oil that thins as it warms."""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import ForceTerms, Observed, Signals, Values

LEAST_WARMING_K = 3.0
"""A recording in which the oil warms by less shows nothing of it (E)."""
REFERENCE_DEGC = 20.0
"""Temperature at which friction is the believed one."""


def viscous_factor(oil_temperature_degc: Any, rate: float) -> Any:
    """sigma(T) / sigma(20 degC)."""
    return np.exp(-rate * (oil_temperature_degc - REFERENCE_DEGC))


class TemperatureFriction(Effect):
    """Oil that thins as it warms."""

    kind = "friction.temperature"
    equation = "sigma(T) = sigma exp(-rate (T - 20 degC))"
    text = "viscous friction falls as the oil warms"
    parameters = (
        ParameterSpec(
            "rate", "1/K", -0.2, 0.2, (0.008, 0.045), "relative fall of sigma per kelvin"
        ),
        ParameterSpec(
            "coulomb_rate", "1/K", -0.2, 0.2, (-0.01, 0.02), "the same for the Coulomb term", 0.0
        ),
    )
    needs = ("position", "oil_temperature")
    shapes = ("coulomb_rate",)
    relative_to = ("viscous_plus_n_s_m", "viscous_minus_n_s_m")
    live = {"rate": "viscosity_rate_1_k"}
    telling_motion = "the same constant-speed strokes with cold and with warm oil"
    alike = {"sensor.drift_a": "a drift goes on when the oil's temperature stands still"}
    hides = {"rate": "seal.viscosity_rate"}

    def force(self, signals: Signals, terms: ForceTerms, values: Values) -> None:
        """The viscous term thins, as a further shape the Coulomb term too."""
        assert signals.oil_temperature_degc is not None  # `needs`
        temperature = signals.oil_temperature_degc.clip(-40.0, 150.0)
        terms.viscous_scale = terms.viscous_scale * viscous_factor(temperature, values["rate"])
        if values["coulomb_rate"]:
            terms.coulomb_scale = terms.coulomb_scale * viscous_factor(
                temperature, values["coulomb_rate"]
            )

    def unseen(self, observed: Observed) -> str | None:
        """Without warming there is nothing to see."""
        if observed.oil_temperature_span_k < LEAST_WARMING_K:
            return "the oil's temperature hardly changes in these recordings"
        return None

    def starts(self, observed: Observed) -> list[dict[str, float]]:
        """A little of it."""
        return [{"rate": 0.002}]

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Less viscous friction than believed, in proportion to the warmth."""
        i = seen.axis(place)
        warm = seen.oil_degc - REFERENCE_DEGC
        return {"rate": Change(force={i: -warm * seen.viscous_n[:, i]})}


EFFECTS = (TemperatureFriction(),)
