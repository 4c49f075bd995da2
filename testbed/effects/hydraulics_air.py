"""hydraulics.air: oil softened by entrained air."""

from __future__ import annotations

from typing import Any

from testbed.effects.base import Effect, FlowTerms, ParameterSpec, Signals, Values

ATMOSPHERE_PA = 1e5


def compliance_1_pa(pressure_pa: Any, fraction: float, exponent: float = 1.0 / 1.4) -> Any:
    """What free air adds to 1/beta at a gauge pressure >= 0."""
    absolute = pressure_pa + ATMOSPHERE_PA
    return fraction * exponent / absolute * (ATMOSPHERE_PA / absolute) ** exponent


def _flow(signals: Signals, terms: FlowTerms, p: Values) -> None:
    terms.gas_fraction += p["fraction"]
    terms.gas_exponent = p["exponent"]


EFFECT = Effect(
    name="hydraulics.air",
    equation="1/beta = 1/beta_declared + fraction / (1.4 (p + p0)) (p0 / (p + p0))^(1/1.4), p0 = 1 bar",
    text="entrained air softens the oil at low pressure",
    parameters=(
        ParameterSpec(
            "fraction", "1", 0.0, 1.0, (0.002, 0.04), "volume of free air per volume at 1 bar"
        ),
        ParameterSpec(
            "exponent", "1", 0.2, 1.2, (0.3, 1.0), "1/1.4 adiabatic, 1 isothermal", 1.0 / 1.4
        ),
    ),
    needs=("position", "pressure_a", "pressure_b", "valve_command"),
    kinds=("vertical-leg",),
    flow=_flow,
    law=compliance_1_pa,
    seen_in=("flow",),
)
