"""friction.temperature: oil that thins as it warms."""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.effects.base import Effect, ForceTerms, ParameterSpec, Signals, Values

REFERENCE_DEGC = 20.0


def viscous_factor(oil_temperature_degc: Any, rate: float) -> Any:
    """sigma(T) / sigma(20 degC)."""
    return np.exp(-rate * (oil_temperature_degc - REFERENCE_DEGC))


def _force(signals: Signals, terms: ForceTerms, p: Values) -> None:
    if signals.oil_temperature_degc is None:
        return
    temperature = signals.oil_temperature_degc.clip(-40.0, 150.0)
    terms.viscous_scale = terms.viscous_scale * viscous_factor(temperature, p["rate"])
    if p["coulomb_rate"]:
        terms.coulomb_scale = terms.coulomb_scale * viscous_factor(temperature, p["coulomb_rate"])


EFFECT = Effect(
    name="friction.temperature",
    equation="sigma(T) = sigma exp(-rate (T - 20 degC))",
    text="viscous friction falls as the oil warms",
    parameters=(
        ParameterSpec(
            "rate", "1/K", -0.2, 0.2, (0.008, 0.045), "relative fall of sigma per kelvin"
        ),
        ParameterSpec(
            "coulomb_rate", "1/K", -0.2, 0.2, (-0.01, 0.02), "the same for the Coulomb term", 0.0
        ),
    ),
    needs=("position", "oil_temperature"),
    force=_force,
    law=viscous_factor,
)
