"""friction.load: guides that are pressed by the foot's load."""

from __future__ import annotations

from typing import Any

from testbed.effects.base import Effect, ForceTerms, ParameterSpec, Signals, Values

REFERENCE_LOAD_N = 1e4
"""At this load the exponent changes nothing."""


def coulomb_increase_n(external_force_n: Any, coefficient: float, exponent: float = 1.0) -> Any:
    """Added Coulomb force in N for an external force in N, positive when the ground pushes the foot up."""
    load = 0.5 * (external_force_n + abs(external_force_n))
    return coefficient * REFERENCE_LOAD_N * (load / REFERENCE_LOAD_N) ** exponent


def _force(signals: Signals, terms: ForceTerms, p: Values) -> None:
    terms.load_coefficient += p["coefficient"]
    terms.load_exponent = p["exponent"]


EFFECT = Effect(
    name="friction.load",
    equation="F_c = F_c0 + coefficient max(F_ext, 0)",
    text="the Coulomb term grows with the foot's load: side forces in the guides",
    parameters=(
        ParameterSpec("coefficient", "1", -0.5, 0.9, (0.01, 0.1), "added Coulomb force per load"),
        ParameterSpec("exponent", "1", 0.2, 4.0, (0.5, 2.0), "power of the load, 1 at 10 kN", 1.0),
    ),
    force=_force,
    law=coulomb_increase_n,
)
