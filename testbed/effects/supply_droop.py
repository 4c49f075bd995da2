"""supply.droop: a supply that gives way under flow."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from testbed.compiled import njit
from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import FlowTerms, Hidden, Observed, Signals, Values
from testbed.formats.arrays import Array
from testbed.machine.names import AXES
from testbed.machine.scale import Scale


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
    for index in range(len(against_pa)):
        drawn = flow_per_root[index] * np.sqrt(max(supply - against_pa[index], 0.0))
        aim = nominal_pa - droop * drawn
        supply = aim + (supply - aim) * keep
        out[index] = supply
    return out


TIMES_S = (0.05, 0.3, 1.0)
"""With which the supply of a whole robot is tried to follow its flow."""


SOUND_SHARE, SOUND_COST = 0.01, 1.0e3
"""Of the supply pressure by so much any regulated pump gives way at the valve's rated flow (E), and
what a droop costs that gives way by next to nothing."""


LEAST_DROOP = 1.0 / 3.0
"""A whole robot's supply that gives way by less than this share of what is usual is none that
anybody would look for: its devices, whose flow nobody measures, make as much of it (E).
"""


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
    telling_motion = "full-speed strokes after a rest, with the supply pressure recorded"
    lowest = 0.0
    usual = 2.0e9

    @property
    def places_on_robot(self) -> tuple[str, ...]:
        """All cylinders feel the one unit alike."""
        return self.places[:1]

    def price(self, values: Values, observed: Observed) -> float:
        """A pump gives way by itself, and on a leg that is no finding: what a droop costs below
        SOUND_SHARE.
        """
        known = observed.known
        if observed.kind != "vertical-leg" or not known.supply_pressure_nominal_pa:
            return 0.0
        lost_pa = values["droop"] * (known.valve_rated_flow_m3_s or 0.0)
        share = lost_pa / known.supply_pressure_nominal_pa
        return SOUND_COST * max(1.0 - share / SOUND_SHARE, 0.0)

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

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """A supply that gives way with the drawn flow, at once and late."""
        return {
            f"droop {index}": Change(supply=seen.supply_by_droop[:, index])
            for index in range(len(TIMES_S))
        }

    def possible(self, numbers: Mapping[str, Array], scale: Scale) -> npt.NDArray[np.bool_]:
        """All droops together are worth looking for."""
        whole = np.sum(list(numbers.values()), axis=0)
        least = LEAST_DROOP * self.usual * self.grows("droop", scale)
        return np.asarray(whole >= least)

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """All droops together, with their mean time."""
        parts = np.array([linear[f"droop {index}"] for index in range(len(TIMES_S))])
        whole = float(parts.sum())
        mean = float(parts @ np.array(TIMES_S)) / whole if whole else TIMES_S[0]
        return {"droop": whole, "time": float(np.clip(mean, TIMES_S[0], TIMES_S[-1]))}


def late(values: Array, time_s: Array, lag_s: float) -> Array:
    """Values (n,) at even times as a first-order lag hands them on."""
    keep = float(np.exp(-(time_s[1] - time_s[0]) / lag_s))
    out = np.empty_like(values)
    state = float(values[0])
    for index, value in enumerate(values):
        state = float(value) + (state - float(value)) * keep
        out[index] = state
    return out


EFFECTS = (Droop(),)
