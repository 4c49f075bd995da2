"""Figure 5 on one leg: after a raising step the one-chamber force decays towards the true weight
while positions hold.

The carried mass rides on a vertical cylinder (x its extension, m; load along -x); a position loop
holds it within a tolerance.
While the leg rises, the oil that leaves chamber B through its edge to the tank holds a back
pressure there; the valve shuts on it. If its shut edges leak more to the tank than from the supply,
that back pressure drains within tens of seconds, and chamber A, which carries weight plus pB A_B,
falls towards the weight. With edges that leak alike it stays.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.paper.machine import chosen
from testbed.compiled import njit
from testbed.formats.records import Record, quantity
from testbed.laws.coupling import centre_window
from testbed.laws.hydraulics import AxisInput, hydraulic_step
from testbed.laws.initial import start_axes, start_supply
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.machine.names import GRAVITY_M_S2
from testbed.world.plumbing import axis_parameters, unit_parameters
from testbed.world.switches import switch_off

Array = NDArray[np.float64]
STEP_S = 1e-3
CARRIED_KG = 1000.0
"""A quarter of the robot."""
COLD_DEGC = 20.0
"""The oil was cold in all the paper's experiments (A); the number is assumed."""
START_M, RISE_M, RISE_S, RISE_AT_S = 0.1, 0.02, 0.5, 2.0
OVERLAPPED: Mapping[str, float] = {
    "valve.edge_pa_leakage_m3_s_pa": 0.0,
    "valve.edge_pb_leakage_m3_s_pa": 0.0,
    "valve.edge_at_leakage_m3_s_pa": 1.0e-13,
    "valve.edge_bt_leakage_m3_s_pa": 1.0e-13,
}
"""Edges that leak to the tank alone: an overlapped spool whose supply edges are tight (assumed)."""


class Moment(Record):
    """A millisecond of the step."""

    reference = quantity("m", "set point")
    reference_rate = quantity("m/s", "its rate")
    position = quantity("m", "of the piston")
    pressure_a = quantity("Pa", "piston side, gauge")


@dataclass(frozen=True)
class Decay:
    """One raising step: one-chamber force (1), N, and position, m, over time, s; and what became of
    them.
    """

    t_s: Array
    one_chamber_n: Array
    position_m: Array
    weight_n: float
    start_n: float
    """One-chamber force a second after the step, above the weight."""
    end_n: float
    """The same at the end."""
    half_time_s: float
    """Until half of what goes has gone; nan if less than a tenth goes."""
    moved_m: float
    """How far the position went meanwhile."""

    @property
    def gone(self) -> float:
        """Share of the excess over the weight that decays; negative if it grows."""
        return 1.0 - self.end_n / self.start_n


@njit
def hold_loop(
    axes: Any,
    params: Any,
    given: Any,
    supply: Any,
    unit: Any,
    tolerance: float,
    moments: Any,
) -> None:
    """Follow the references of `moments`, a Moment a millisecond, by a valve shut within the
    tolerance.
    """
    p, rod = params[0], given[0]
    position, rate = moments[0].reference, 0.0
    for k in range(moments.shape[0]):
        now = moments[k]
        error = now.reference - position
        wanted = now.reference_rate + 8.0 * error
        if now.reference_rate == 0.0 and abs(error) < tolerance:
            wanted = 0.0
        edge = p.a.from_supply if wanted > 0.0 else p.a.to_tank
        opening = wanted * p.a.area / (edge * math.sqrt(3.0e6))
        band = p.valve.dead_band
        rod.command = 0.0 if wanted == 0.0 else opening * (1.0 - band) + math.copysign(band, wanted)
        centre_window(rod, position, rate, STEP_S)
        hydraulic_step(axes, params, given, supply, unit, STEP_S, 2)
        rate += STEP_S * (axes[0].force / CARRIED_KG - GRAVITY_M_S2)
        position += STEP_S * rate
        now.position = position
        now.pressure_a = axes[0].a.pressure - ATMOSPHERE_PA


def raising_step(
    changes: Mapping[str, float], without: Sequence[str] = (), seconds: float = 40.0
) -> Decay:
    """One step of 20 mm, then `seconds` of holding; `changes` of the parameter file, parts left out
    by name.
    """
    machine = chosen().machine(changes)
    params = axis_parameters(machine)[2:3].copy()
    unit = unit_parameters(machine)
    switch_off(without, params, unit)
    weight = CARRIED_KG * GRAVITY_M_S2
    t: Array = STEP_S * np.arange(round((RISE_AT_S + RISE_S + seconds) / STEP_S), dtype=np.float64)
    rising = (t >= RISE_AT_S) & (t < RISE_AT_S + RISE_S)
    rate = np.where(rising, RISE_M / RISE_S, 0.0)
    moments, given = Moment.zeros(len(t)), AxisInput.zeros()
    moments["reference"], moments["reference_rate"] = START_M + STEP_S * np.cumsum(rate), rate
    axes = start_axes(params, moments["reference"][:1], np.array([weight]), 2.0e6)
    tolerance = machine.control.tolerance_m
    supply = start_supply(unit, COLD_DEGC, 0.06)
    hold_loop(axes, params, given, supply, unit, tolerance, moments)
    position, force = moments["position"], moments["pressure_a"] * params[0].a.area
    after = t >= RISE_AT_S + RISE_S + 1.0
    held, excess = t[after], force[after] - weight
    end = float(excess[-2000:].mean())
    half = np.nonzero(excess < 0.5 * (excess[0] + end))[0]
    half_time = float(held[half[0]] - held[0]) if len(half) and end < 0.9 * excess[0] else math.nan
    return Decay(
        t, force, position, weight, float(excess[0]), end, half_time, float(np.ptp(position[after]))
    )
