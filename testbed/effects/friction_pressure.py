"""friction.pressure: seals that press harder under pressure."""

from __future__ import annotations

from typing import Any

from testbed.effects.base import Effect, ForceTerms, ParameterSpec, Signals, Values

REFERENCE_PRESSURE_PA = 1e7
"""At this pA + pB the exponent changes nothing."""


def coulomb_increase_n(
    pressure_a_pa: Any,
    pressure_b_pa: Any,
    coefficient: float,
    imbalance: float = 0.0,
    exponent: float = 1.0,
) -> Any:
    """Added Coulomb force in N; exponent = 1 and imbalance = 0 are the contract's formula. Pressures >= 0."""
    total = pressure_a_pa + pressure_b_pa
    bent = (
        total
        if exponent == 1.0
        else REFERENCE_PRESSURE_PA * (total / REFERENCE_PRESSURE_PA) ** exponent
    )
    return coefficient * bent + imbalance * (pressure_a_pa - pressure_b_pa)


def _force(signals: Signals, terms: ForceTerms, p: Values) -> None:
    a, b = signals.pressure_a_pa, signals.pressure_b_pa
    if a is None:
        return
    a = a.clip(0.0)
    other = b.clip(0.0) if b is not None else 0.0 * a
    added = coulomb_increase_n(a, other, p["coefficient"], p["imbalance"], p["exponent"])
    terms.coulomb_add_n = terms.coulomb_add_n + added


EFFECT = Effect(
    name="friction.pressure",
    equation="F_c = F_c0 + coefficient (pA + pB)",
    text="the Coulomb term grows with the pressures: lip seals",
    parameters=(
        ParameterSpec(
            "coefficient", "m2", -2e-3, 2e-3, (1e-5, 1.2e-4), "added Coulomb force per pressure"
        ),
        ParameterSpec("imbalance", "m2", -2e-3, 2e-3, (-3e-5, 3e-5), "the same for pA - pB", 0.0),
        ParameterSpec(
            "exponent", "1", 0.2, 4.0, (0.5, 2.0), "power of the pressure, 1 at 100 bar", 1.0
        ),
    ),
    needs=("position", "pressure_a"),
    kinds=("vertical-leg", "cylinder"),
    force=_force,
    law=coulomb_increase_n,
)
