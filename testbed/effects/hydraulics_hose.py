"""hydraulics.hose: chamber A feeds a hose that fills slowly."""

from __future__ import annotations

from testbed.effects.base import Effect, FlowTerms, ParameterSpec, Signals, Values


def flow_m3_s(pressure_a_pa: float, hose_pa: float, capacity: float, time: float) -> float:
    """Flow out of A into the hose; the hose follows with dph/dt = (pA - ph) / time."""
    return capacity * (pressure_a_pa - hose_pa) / time


def _flow(signals: Signals, terms: FlowTerms, p: Values) -> None:
    terms.hose_capacity_m3_pa += p["capacity"]
    terms.hose_time_s = p["time"]


EFFECT = Effect(
    name="hydraulics.hose",
    equation="q = capacity (pA - ph) / time, dph/dt = (pA - ph) / time",
    text="a soft hose behind chamber A takes oil and gives it back later",
    parameters=(
        ParameterSpec("capacity", "m3/Pa", 0.0, 1e-9, (2e-13, 6e-12), "oil taken per pressure"),
        ParameterSpec("time", "s", 1e-3, 20.0, (0.03, 1.0), "time in which it fills"),
    ),
    needs=("position", "pressure_a", "pressure_b", "valve_command"),
    kinds=("vertical-leg",),
    flow=_flow,
    law=flow_m3_s,
    seen_in=("flow",),
)
