"""inertia.mass: more mass on the rod than declared."""

from __future__ import annotations

from testbed.effects.base import Effect, ForceTerms, ParameterSpec, Signals, Values


def _force(signals: Signals, terms: ForceTerms, p: Values) -> None:
    terms.added_mass_kg += p["mass"]
    terms.weight_mass_kg += p["mass"] * p["weight_share"]


EFFECT = Effect(
    name="inertia.mass",
    equation="m = m_declared + mass, in weight and inertia",
    text="the leg carries more (or less) mass than declared: mud, a tool, a wrong drawing",
    parameters=(
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
    ),
    force=_force,
)
