"""hydraulics.hose: chamber A feeds a hose that fills slowly."""

from __future__ import annotations

import numpy as np

from testbed.compiled import njit
from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import FlowTerms, Observed, Signals, Values
from testbed.formats.arrays import Array


def flow_m3_s(pressure_a_pa: float, hose_pa: float, capacity: float, time: float) -> float:
    """Flow out of A into the hose; the hose follows with dph/dt = (pA - ph) / time."""
    return capacity * (pressure_a_pa - hose_pa) / time


HOSE_TIMES_S = (0.05, 0.3)
"""A hose of any time between is a mixture of these two, nearly."""


@njit
def hose_flow_m3_s(pressure_a_pa: Array, capacity: float, time: float, period_s: float) -> Array:
    """Flow into the hose over a recording, (n,); exact for a pressure that goes straight between
    samples.
    """
    flow = np.empty_like(pressure_a_pa)
    gap, keep = 0.0, np.exp(-period_s / time)
    filled = time / period_s * (1.0 - keep)
    for index in range(len(pressure_a_pa)):
        if index:
            gap = gap * keep + (pressure_a_pa[index] - pressure_a_pa[index - 1]) * filled
        flow[index] = capacity * gap / time
    return flow


class Hose(Effect):
    """Chamber A feeds a hose that fills slowly."""

    kind = "hydraulics.hose"
    equation = "q = capacity (pA - ph) / time, dph/dt = (pA - ph) / time"
    text = "a soft hose behind chamber A takes oil and gives it back later"
    parameters = (
        ParameterSpec(
            "capacity", "m3/Pa", 0.0, 1e-9, (2e-13, 6e-12), "oil taken per pressure", log=True
        ),
        ParameterSpec("time", "s", 1e-3, 20.0, (0.03, 1.0), "time in which it fills", log=True),
    )
    needs = ("position", "pressure_a", "pressure_b", "valve_command")
    rigs = ("vertical-leg",)
    seen_in = ("flow",)
    telling_motion = "steps of pressure in A with the piston held, then a minute of rest"
    alike = {"hydraulics.air": "air softens both chambers, and at low pressure only"}
    hides = {"capacity": "a.hose_capacity", "time": "hose_time"}
    lowest = 0.0
    usual = 1.0e-12

    def flow(self, signals: Signals, terms: FlowTerms, values: Values) -> None:
        """Chamber A gives and takes oil."""
        terms.hose_capacity_m3_pa += values["capacity"]
        terms.hose_time_s = values["time"]

    def starts(self, observed: Observed) -> list[dict[str, float]]:
        """A quick one and a slow one."""
        return [{"time": time} for time in (0.05, 0.4)]

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Oil that chamber A takes up later, of hoses that fill quickly and slowly."""
        axis = seen.axis(place)
        return {
            f"capacity {index}": Change(oil={axis: seen.oil_by_hose[:, axis, index]})
            for index in range(len(HOSE_TIMES_S))
        }

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """All hoses together, with their mean time."""
        parts = [linear[f"capacity {index}"] for index in range(len(HOSE_TIMES_S))]
        whole = sum(parts)
        time = (
            sum(part * time_s for part, time_s in zip(parts, HOSE_TIMES_S, strict=True)) / whole
            if whole
            else 0.0
        )
        return {"capacity": whole, "time": max(time, 0.0)}


EFFECTS = (Hose(),)
