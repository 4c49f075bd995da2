"""supply.droop: a supply that gives way under flow."""

from __future__ import annotations

from testbed.effects.base import Effect, FlowTerms, ParameterSpec, Signals, Values


def supply_rate_pa_s(
    supply_pa: float, nominal_pa: float, drawn_m3_s: float, droop: float, time: float
) -> float:
    """dps/dt = (ps0 - ps) / time - droop q / time, q the flow that the valve draws."""
    return (nominal_pa - supply_pa) / time - droop * drawn_m3_s / time


def _flow(signals: Signals, terms: FlowTerms, p: Values) -> None:
    terms.droop_pa_s_m3 += p["droop"]
    terms.droop_time_s = p["time"]


EFFECT = Effect(
    name="supply.droop",
    equation="dps/dt = (ps0 - ps) / time - droop q / time",
    text="the supply pressure falls while the axis draws oil",
    parameters=(
        ParameterSpec(
            "droop", "Pa s/m3", 0.0, 1e12, (2e8, 8e9), "fall of the supply pressure per flow"
        ),
        ParameterSpec("time", "s", 1e-3, 20.0, (0.03, 1.0), "time in which the supply follows"),
    ),
    needs=("position", "pressure_a", "pressure_b", "valve_command", "supply_pressure"),
    kinds=("vertical-leg",),
    flow=_flow,
    law=supply_rate_pa_s,
    seen_in=("flow", "supply"),
)
