"""The flow balances of both chambers of a leg, with what the effects make of them.

    r_A = Q_A - A_A v - q_AB - q_hose - V_A (1/beta) dpA/dt,   r_B = Q_B + A_B v + q_AB - V_B (1/beta) dpB/dt

in m3/s, zero where the model is right.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.compiled import njit
from testbed.effects.base import Active
from testbed.effects.hydraulics_air import compliance_1_pa
from testbed.effects.leakage_internal import flow_m3_s as leak_m3_s
from testbed.effects.terms import FlowTerms, Signals
from testbed.effects.valve_deadband import opening
from testbed.estimation.leg.motion import smooth
from testbed.laws.linear import second_order

Array = npt.NDArray[np.float64]
SMOOTH_DROP_PA = 5e4
"""Below this drop the orifice's square root is smoothed: sqrt has no slope at zero."""


@dataclass(frozen=True)
class Edge:
    """A metering edge: its gain against the plate, and the drop below which its flow grows straight, Pa.

    `share_b`: size of the edges at chamber B against those at A, for a spool ground for a differential cylinder.
    """

    gain: float = 1.0
    smooth_pa: float = SMOOTH_DROP_PA
    share_b: float = 1.0


@dataclass(frozen=True)
class FlowBalance:
    """Residuals of the flow balances, m3/s, and of the supply, Pa; each of shape (n,)."""

    a_m3_s: Array
    b_m3_s: Array
    supply_pa: Array | None


def flow_terms(signals: Signals, effects: Sequence[Active]) -> FlowTerms:
    """The flow balance with every effect's change."""
    known = signals.known
    terms = FlowTerms(
        leakage_m3_s_pa=known.internal_leakage_m3_s_pa or 0.0, deadband=known.valve_deadband or 0.0
    )
    for active in effects:
        active.flow(signals, terms)
    return terms


COMMAND_LEAD_SAMPLES = 0.75
"""A row's command already acts in the sampling interval that the row closes: measured on recordings of a sound leg."""


def spool(command: Array, rate_hz: float, natural_frequency_hz: float, damping: float) -> Array:
    """Spool position (-1..1), shape (n,): exact second-order response to a command held between samples."""
    step = second_order(2.0 * np.pi * natural_frequency_hz, damping, 1.0 / rate_hz)
    late = _following(np.asarray(command, dtype=np.float64), *step)
    index = np.arange(len(command), dtype=np.float64)
    return np.asarray(np.interp(index + COMMAND_LEAD_SAMPLES, index, late), dtype=np.float64)


@njit
def _following(command: Array, yy: float, yr: float, ry: float, rr: float) -> Array:
    """Position (n,) of a second-order system that starts at rest on its command, held between samples."""
    out = np.empty(command.size)
    y, rate = command[0], 0.0
    for k in range(command.size):
        out[k] = y
        off = y - command[k]
        y = command[k] + yy * off + yr * rate
        rate = ry * off + rr * rate
    return out


@njit
def edge_flow(
    open_: Any,
    drop_pa: Any,
    rated_m3_s: float,
    rated_drop_pa: float,
    smooth_pa: float = SMOOTH_DROP_PA,
) -> Any:
    """Q = rated |o| sign(dp) sqrt(|dp| / rated drop), smooth near dp = 0; m3/s; for one sample or shape (n,)."""
    return (
        rated_m3_s
        * np.abs(open_)
        * (drop_pa / np.sqrt((np.abs(drop_pa) + smooth_pa) * rated_drop_pa))
    )


def smoothed_opening(spool_: Array, deadband: float, width_samples: float, step: int = 1) -> Array:
    """The valve's opening, smoothed like the other channels; every `step`-th sample."""
    return smooth(np.asarray(opening(spool_, deadband), dtype=np.float64), width_samples)[::step]


def flow_balance(
    signals: Signals, terms: FlowTerms, open_: Array, edge: Edge = Edge()
) -> FlowBalance:
    """Residuals for signals whose sensors are already corrected; `open_` from `smoothed_opening` on the same grid.

    `edge` is what a valve's plate does not say to the last per cent.
    """
    k = signals.known
    pa, pb = signals.pressure_a_pa, signals.pressure_b_pa
    assert (
        pa is not None
        and pb is not None
        and k.valve_rated_flow_m3_s
        and k.valve_rated_drop_per_edge_pa
    )
    assert k.supply_pressure_nominal_pa and k.bulk_modulus_pa and k.stroke_m
    rated, drop, tank = (
        edge.gain * k.valve_rated_flow_m3_s,
        k.valve_rated_drop_per_edge_pa,
        k.tank_pressure_pa or 0.0,
    )
    o = open_
    nominal = k.supply_pressure_nominal_pa
    supply: Array | float = nominal
    if terms.droop_pa_s_m3 > 0.0:
        supply = _supply(
            o,
            pa,
            pb,
            nominal,
            rated,
            drop,
            terms.droop_pa_s_m3,
            terms.droop_time_s,
            1.0 / signals.rate_hz,
        )
    leak: Array | float = 0.0
    if terms.leakage_m3_s_pa:
        leak = leak_m3_s(pa - pb, terms.leakage_m3_s_pa, terms.leakage_exponent)
    x, v = signals.position_m, signals.velocity_m_s
    soft_a: Array | float = 1.0 / k.bulk_modulus_pa
    soft_b: Array | float = soft_a
    if terms.gas_fraction > 0.0:
        soft_a = soft_a + compliance_1_pa(pa.clip(0.0), terms.gas_fraction, terms.gas_exponent)
        soft_b = soft_b + compliance_1_pa(pb.clip(0.0), terms.gas_fraction, terms.gas_exponent)
    sizes = np.array([rated, edge.share_b, drop, edge.smooth_pa, tank, signals.rate_hz])
    chambers = np.array(
        [
            k.area_a_m2,
            k.area_b_m2,
            k.dead_volume_a_m3 or 0.0,
            k.dead_volume_b_m3 or 0.0,
            k.stroke_m,
        ],
        dtype=np.float64,
    )
    varied = [
        np.broadcast_to(np.asarray(c, dtype=np.float64), pa.shape)
        for c in (supply, leak, soft_a, soft_b)
    ]
    a, b = _chambers(o, pa, pb, x, v, *varied, sizes, chambers)
    if terms.hose_capacity_m3_pa > 0.0:
        a = a - _hose(pa, terms.hose_capacity_m3_pa, terms.hose_time_s, 1.0 / signals.rate_hz)
    evidence = None
    if signals.supply_pressure_pa is not None:
        evidence = signals.supply_pressure_pa - supply
    return FlowBalance(a, b, evidence)


@njit
def _chambers(
    o: Array,
    pa: Array,
    pb: Array,
    x: Array,
    v: Array,
    supply: Array,
    leak: Array,
    soft_a: Array,
    soft_b: Array,
    sizes: Array,
    chambers: Array,
) -> tuple[Array, Array]:
    """Both balances but the hose, m3/s, each of shape (n,).

    `sizes`: rated flow, share of the edges at B, rated drop, smooth drop, tank pressure, rate in Hz; `chambers`: both
    areas, both dead volumes, stroke.
    """
    rated, share, drop, smooth_pa, tank, rate_hz = sizes
    area_a, area_b, dead_a, dead_b, stroke = chambers
    a, b = np.empty_like(pa), np.empty_like(pa)
    last = len(pa) - 1
    for i in range(len(pa)):
        before, after = max(i - 1, 0), min(i + 1, last)
        rate = rate_hz / max(after - before, 1)
        if o[i] > 0.0:
            flow_a = edge_flow(o[i], supply[i] - pa[i], rated, drop, smooth_pa)
            flow_b = -edge_flow(o[i], pb[i] - tank, share * rated, drop, smooth_pa)
        else:
            flow_a = -edge_flow(o[i], pa[i] - tank, rated, drop, smooth_pa)
            flow_b = edge_flow(o[i], supply[i] - pb[i], share * rated, drop, smooth_pa)
        swept_a = (
            area_a * v[i]
            + leak[i]
            + (dead_a + area_a * x[i]) * soft_a[i] * (pa[after] - pa[before]) * rate
        )
        swept_b = (
            area_b * v[i]
            + leak[i]
            - (dead_b + area_b * (stroke - x[i])) * soft_b[i] * (pb[after] - pb[before]) * rate
        )
        a[i], b[i] = flow_a - swept_a, flow_b + swept_b
    return a, b


@njit
def _hose(pressure_a: Array, capacity: float, time_s: float, period_s: float) -> Array:
    """Flow into the hose, m3/s; the hose's pressure follows exactly for a pressure held over a period."""
    flow = np.empty_like(pressure_a)
    inside = pressure_a[0]
    keep = np.exp(-period_s / time_s)
    for i in range(len(pressure_a)):
        flow[i] = capacity * (pressure_a[i] - inside) / time_s
        inside = pressure_a[i] + (inside - pressure_a[i]) * keep
    return flow


@njit
def _supply(
    o: Array,
    pa: Array,
    pb: Array,
    nominal: float,
    rated: float,
    drop: float,
    droop: float,
    time_s: float,
    period_s: float,
) -> Array:
    """Supply pressure, Pa: follows nominal - droop * drawn flow with `time_s`."""
    out = np.empty_like(pa)
    supply = nominal
    keep = np.exp(-period_s / time_s)
    for i in range(len(pa)):
        against = pa[i] if o[i] > 0.0 else pb[i]
        drawn = rated * abs(o[i]) * np.sqrt(max(supply - against, 0.0) / drop)
        aim = nominal - droop * drawn
        supply = aim + (supply - aim) * keep
        out[i] = supply
    return out
