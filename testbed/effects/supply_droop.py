"""supply.droop: a supply that gives way under flow."""

from __future__ import annotations

import numpy as np

from testbed.compiled import njit
from testbed.effects.base import Effect, ParameterSpec
from testbed.effects.fitting import Observed
from testbed.effects.hidden import Hidden
from testbed.effects.terms import Array, FlowTerms, Signals, Values
from testbed.machine.names import AXES


@njit
def drooping_pa(
    nominal_pa: float,
    against_pa: Array,
    flow_per_root: Array,
    droop_and_time: tuple[float, float],
    period_s: float,
) -> Array:
    """Supply pressure over a recording, (n,), Pa: it follows nominal - droop q.

    q = flow_per_root sqrt(ps - against): what an edge that opens to a chamber at `against_pa`
    draws.
    """
    out = np.empty_like(against_pa)
    supply = nominal_pa
    droop, time = droop_and_time
    keep = np.exp(-period_s / time)
    for k in range(len(against_pa)):
        drawn = flow_per_root[k] * np.sqrt(max(supply - against_pa[k], 0.0))
        aim = nominal_pa - droop * drawn
        supply = aim + (supply - aim) * keep
        out[k] = supply
    return out


class Droop(Effect):
    """A supply that gives way under flow."""

    kind = "supply.droop"
    equation = "dps/dt = (ps0 - ps) / time - droop q / time"
    text = "the supply pressure falls while the axis draws oil"
    parameters = (
        ParameterSpec(
            "droop",
            "Pa s/m3",
            0.0,
            1e12,
            (2e8, 8e9),
            "fall of the supply pressure per flow",
            log=True,
        ),
        ParameterSpec(
            "time", "s", 1e-3, 20.0, (0.03, 1.0), "time in which the supply follows", log=True
        ),
    )
    needs = ("position", "pressure_a", "pressure_b", "valve_command", "supply_pressure")
    rigs = ("vertical-leg",)
    seen_in = ("flow", "supply")
    places = ("supply", *AXES)  # one power unit; a cylinder as its place is where it is felt
    sought_on_robot = False
    telling_motion = "full-speed strokes after a rest, with the supply pressure recorded"

    def flow(self, signals: Signals, terms: FlowTerms, values: Values) -> None:
        """The supply pressure follows the drawn flow."""
        terms.droop_pa_s_m3 += values["droop"]
        terms.droop_time_s = values["time"]

    def starts(self, observed: Observed) -> list[dict[str, float]]:
        """A quick supply and a slow one."""
        return [{"time": time} for time in (0.05, 0.4)]

    def hide(self, world: Hidden, place: str, values: Values) -> None:
        """Of the one power unit."""
        world.droop_pa_s_m3, world.droop_s = values["droop"], values["time"]


EFFECTS = (Droop(),)
