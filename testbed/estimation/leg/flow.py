"""The flow balances of both chambers of a leg, with what the effects make of them.

    r_A = Q_A - A_A v - q_AB - q_hose - V_A (1/beta) dpA/dt
    r_B = Q_B + A_B v + q_AB - V_B (1/beta) dpB/dt

in m3/s, zero where the model is right.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from testbed.compiled import njit
from testbed.effects.active import Active
from testbed.effects.hydraulics_air import compliance_1_pa
from testbed.effects.hydraulics_hose import hose_flow_m3_s
from testbed.effects.leakage_internal import flow_m3_s as leak_m3_s
from testbed.effects.supply_droop import drooping_pa
from testbed.effects.terms import FlowTerms, Signals
from testbed.effects.valve_deadband import opening
from testbed.estimation.leg.motion import later, slope, smooth
from testbed.formats.arrays import Array
from testbed.laws.holding import NO_HOLDING, outlet_share
from testbed.recording.known import HOLDINGS, Circuit, Known

SMOOTH_DROP_PA = 5e4
"""Below this drop the orifice's square root is smoothed: sqrt has no slope at zero."""


EDGES = ("pa", "at", "pb", "bt")
"""A valve's metering edges: supply to A, A to tank, supply to B, B to tank."""


@dataclass(frozen=True)
class Edges:
    """What a valve's plate does not say of its metering edges to the last per cent."""

    gain: float = 1.0
    """Of all four against the plate, 1."""
    pa: float = 1.0
    """Of the edge from the supply to A against all four, 1."""
    at: float = 1.0
    """Of the edge from A to the tank, 1."""
    pb: float = 1.0
    """Of the edge from the supply to B, 1."""
    bt: float = 1.0
    """Of the edge from B to the tank, 1."""
    smooth_pa: float = SMOOTH_DROP_PA
    """Drop below which their flow grows straight, Pa."""
    late_s: float = 0.0
    """By how much later than COMMAND_LEAD_SAMPLES says they follow the recorded command, s."""
    lap_out: float = 0.0
    """How much further than its dead band says the spool goes before A is fed, share of its
    travel."""
    lap_in: float = 0.0
    """How much further than its dead band says the spool goes before B is fed, share of its
    travel."""
    supply_off_pa: float = 0.0
    """By how much the supply is set, or its sensor reads, beside what is declared, Pa."""
    supply_share: float = 0.0
    """Share of what the measured supply pressure differs by from the believed one that they see."""

    def unevenness(self) -> float:
        """Sum of the squares by which the four differ from their own mean, as shares."""
        sizes = np.log([getattr(self, edge) for edge in EDGES])
        return float(np.sum((sizes - np.mean(sizes)) ** 2))


PLAIN = Edges()
"""A valve as its plate says."""


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


@njit
def edge_flow(
    open_: Any,
    drop_pa: Any,
    rated_m3_s: float,
    rated_drop_pa: float,
    smooth_pa: float = SMOOTH_DROP_PA,
) -> Any:
    """Q = rated |o| sign(dp) sqrt(|dp| / rated drop), smooth near dp = 0; m3/s; for one sample or
    shape (n,).
    """
    return (
        rated_m3_s
        * np.abs(open_)
        * (drop_pa / np.sqrt((np.abs(drop_pa) + smooth_pa) * rated_drop_pa))
    )


def smoothed_opening(
    spool_: Array,
    deadband: float,
    width_samples: float,
    step: int = 1,
    laps: tuple[float, float] = (0.0, 0.0),
) -> Array:
    """The valve's opening, smoothed like the other channels; every `step`-th sample. `laps`: how
    much further than `deadband` the spool goes before it opens, outwards and inwards.
    """
    open_ = opening(spool_, deadband)
    if any(laps):
        further = deadband + np.where(spool_ > 0.0, *laps)
        open_ = np.sign(spool_) * np.maximum(np.abs(spool_) - further, 0.0) / (1.0 - deadband)
    return smooth(np.asarray(open_, dtype=np.float64), width_samples)[::step]


def followed(open_: Array, late_s: float, rate_hz: float) -> Array:
    """The opening (n,) of edges that follow so much later."""
    if not late_s:
        return open_
    return later(open_, late_s * rate_hz)


def flow_balance(
    signals: Signals,
    terms: FlowTerms,
    open_: Array,
    edges: Edges = PLAIN,
    late: Array | None = None,
) -> FlowBalance:
    """Residuals for signals whose sensors are already corrected; `open_` from `smoothed_opening` on
    the same grid.

    `edges`: what a valve's plate does not say to the last per cent. `late`: `open_` as late as they
    follow, where it is at hand.
    """
    pressure_a, pressure_b = signals.pressure_a_pa, signals.pressure_b_pa
    assert pressure_a is not None and pressure_b is not None
    supply = _supply_pa(signals, terms, open_, edges)
    measured, feeding = signals.supply_pressure_pa, supply
    if measured is not None and edges.supply_share:
        feeding = supply + edges.supply_share * (measured - supply)
    open_ = followed(open_, edges.late_s, signals.rate_hz) if late is None else late
    leak: Array | float = 0.0
    if terms.leakage_m3_s_pa:
        drop = pressure_a - pressure_b
        leak = leak_m3_s(drop, terms.leakage_m3_s_pa, terms.leakage_exponent)
    shape = pressure_a.shape
    rows = OilRows(
        opening=open_,
        position_m=signals.position_m,
        velocity_m_s=signals.velocity_m_s,
        pressure_a_pa=pressure_a,
        pressure_b_pa=pressure_b,
        supply_pa=_filled(feeding, shape),
        leak_m3_s=_filled(leak, shape),
        softness_a_1_pa=_filled(_softness(pressure_a, signals.known, terms), shape),
        softness_b_1_pa=_filled(_softness(pressure_b, signals.known, terms), shape),
        rate_a_pa_s=slope(pressure_a, signals.rate_hz),
        rate_b_pa_s=slope(pressure_b, signals.rate_hz),
    )
    flow_a, flow_b = _chambers(rows, _valve(signals.known, edges), _cylinder(signals.known))
    if terms.hose_capacity_m3_pa > 0.0:
        period = 1.0 / signals.rate_hz
        flow_a = flow_a - hose_flow_m3_s(
            pressure_a, terms.hose_capacity_m3_pa, terms.hose_time_s, period
        )
    left = None if measured is None else measured - supply - edges.supply_off_pa
    return FlowBalance(flow_a, flow_b, left)


def edge_slopes(
    signals: Signals, terms: FlowTerms, open_: Array, edges: Edges, late: Array
) -> dict[str, tuple[Array, Array]]:
    """Edge -> d(residual A), d(residual B) per unit of its gain, m3/s, each (n,), where the
    supply does not give way to what it draws: flows are straight in the sizes of the edges, of
    which each chamber has one open at a time.
    """
    more = {edge: (1.0 + WIDER) * getattr(edges, edge) for edge in EDGES}
    wider = flow_balance(signals, terms, open_, replace(edges, **more), late)
    as_is = flow_balance(signals, terms, open_, edges, late)
    slope_a = (wider.a_m3_s - as_is.a_m3_s) / WIDER
    slope_b = (wider.b_m3_s - as_is.b_m3_s) / WIDER
    out, none = late > 0.0, np.zeros(len(late))
    return {
        "pa": (np.where(out, slope_a, 0.0) / edges.pa, none),
        "at": (np.where(out, 0.0, slope_a) / edges.at, none),
        "pb": (none, np.where(out, 0.0, slope_b) / edges.pb),
        "bt": (none, np.where(out, slope_b, 0.0) / edges.bt),
    }


WIDER = 0.01
"""Share by which all edges are widened to see what they do."""


class Valve(NamedTuple):
    """A valve as declared, with its edges as believed."""

    rated_m3_s: float
    rated_drop_pa: float
    smooth_drop_pa: float
    tank_pa: float
    edge_pa: float
    """Size of the edge from supply to A against the rated flow; the other three likewise."""
    edge_at: float
    edge_pb: float
    edge_bt: float
    leakage_pa_m3_s_pa: float
    """Of the edge from supply to A; the other three likewise."""
    leakage_at_m3_s_pa: float
    leakage_pb_m3_s_pa: float
    leakage_bt_m3_s_pa: float
    holding_a: float
    """Kind of the load-holding valve at A (laws/holding.py)."""
    holding_b: float
    setting_pa: float
    """Of a counterbalance valve."""
    pilot_ratio: float


class Cylinder(NamedTuple):
    """A cylinder as declared."""

    area_a_m2: float
    area_b_m2: float
    dead_volume_a_m3: float
    dead_volume_b_m3: float
    stroke_m: float


class OilRows(NamedTuple):
    """What both balances are made of, each of shape (n,)."""

    opening: Array
    position_m: Array
    velocity_m_s: Array
    pressure_a_pa: Array
    pressure_b_pa: Array
    supply_pa: Array
    leak_m3_s: Array
    """From A to B."""
    softness_a_1_pa: Array
    """1/beta, air included."""
    softness_b_1_pa: Array
    rate_a_pa_s: Array
    rate_b_pa_s: Array


def _valve(known: Known, edges: Edges) -> Valve:
    assert known.valve_rated_flow_m3_s and known.valve_rated_drop_per_edge_pa
    circuit = known.circuit or Circuit()
    return Valve(
        edges.gain * known.valve_rated_flow_m3_s,
        known.valve_rated_drop_per_edge_pa,
        edges.smooth_pa,
        known.tank_pressure_pa or 0.0,
        edges.pa * circuit.edge_pa,
        edges.at * circuit.edge_at,
        edges.pb * circuit.edge_pb,
        edges.bt * circuit.edge_bt,
        circuit.leakage_pa_m3_s_pa,
        circuit.leakage_at_m3_s_pa,
        circuit.leakage_pb_m3_s_pa,
        circuit.leakage_bt_m3_s_pa,
        float(HOLDINGS.index(circuit.holding_a)),
        float(HOLDINGS.index(circuit.holding_b)),
        circuit.counterbalance_setting_pa,
        circuit.counterbalance_pilot_ratio,
    )


def _cylinder(known: Known) -> Cylinder:
    assert known.stroke_m
    return Cylinder(
        known.area_a_m2,
        known.area_b_m2,
        known.dead_volume_a_m3 or 0.0,
        known.dead_volume_b_m3 or 0.0,
        known.stroke_m,
    )


def _supply_pa(signals: Signals, terms: FlowTerms, open_: Array, edges: Edges) -> Array | float:
    """The declared supply pressure, less what it gives way under the drawn flow."""
    known, nominal = signals.known, signals.known.supply_pressure_nominal_pa
    assert nominal and signals.pressure_a_pa is not None and signals.pressure_b_pa is not None
    varies = known.circuit is not None and known.circuit.supply == "varying"
    if varies and signals.supply_pressure_pa is not None:
        return signals.supply_pressure_pa
    if terms.droop_pa_s_m3 <= 0.0:
        return nominal
    valve = _valve(known, edges)
    against = np.where(open_ > 0.0, signals.pressure_a_pa, signals.pressure_b_pa)
    feeding = np.where(open_ > 0.0, valve.edge_pa, valve.edge_pb)
    per_root = feeding * valve.rated_m3_s * np.abs(open_) / np.sqrt(valve.rated_drop_pa)
    droop = terms.droop_pa_s_m3, terms.droop_time_s
    return np.asarray(drooping_pa(nominal, against, per_root, droop, 1.0 / signals.rate_hz))


def _softness(pressure_pa: Array, known: Known, terms: FlowTerms) -> Array | float:
    """1/beta of a chamber's oil, with the air in it."""
    assert known.bulk_modulus_pa
    oil = 1.0 / known.bulk_modulus_pa
    if terms.gas_fraction <= 0.0:
        return oil
    air = compliance_1_pa(pressure_pa.clip(0.0), terms.gas_fraction, terms.gas_exponent)
    return np.asarray(oil + air, dtype=np.float64)


def _filled(value: Array | float, shape: tuple[int, ...]) -> Array:
    return np.broadcast_to(np.asarray(value, dtype=np.float64), shape)


@njit
def _held(
    flow: float, opened: bool, kind: float, load_pa: float, pilot_pa: float, valve: Valve
) -> float:
    """What a load-holding valve lets through of the flow into its chamber; pressures over the
    tank's.
    """
    if flow > 0.0:
        return flow
    if not opened:
        return 0.0
    share = outlet_share(kind, load_pa, pilot_pa, valve.setting_pa, valve.pilot_ratio)
    return share * flow


@njit
def _chambers(rows: OilRows, valve: Valve, cylinder: Cylinder) -> tuple[Array, Array]:
    """Both balances but the hose, m3/s, each of shape (n,)."""
    pressure_a, pressure_b = rows.pressure_a_pa, rows.pressure_b_pa
    rated, drop, soft = valve.rated_m3_s, valve.rated_drop_pa, valve.smooth_drop_pa
    a, b = np.empty_like(pressure_a), np.empty_like(pressure_a)
    for index in range(len(pressure_a)):
        open_ = rows.opening[index]
        from_a, from_b = (
            rows.supply_pa[index] - pressure_a[index],
            rows.supply_pa[index] - pressure_b[index],
        )
        to_a, to_b = pressure_a[index] - valve.tank_pa, pressure_b[index] - valve.tank_pa
        flow_a = valve.leakage_pa_m3_s_pa * from_a - valve.leakage_at_m3_s_pa * to_a
        flow_b = valve.leakage_pb_m3_s_pa * from_b - valve.leakage_bt_m3_s_pa * to_b
        if open_ > 0.0:
            flow_a += edge_flow(open_, from_a, valve.edge_pa * rated, drop, soft)
            flow_b -= edge_flow(open_, to_b, valve.edge_bt * rated, drop, soft)
        else:
            flow_a -= edge_flow(open_, to_a, valve.edge_at * rated, drop, soft)
            flow_b += edge_flow(open_, from_b, valve.edge_pb * rated, drop, soft)
        if valve.holding_a != NO_HOLDING:
            flow_a = _held(flow_a, open_ < 0.0, valve.holding_a, to_a, to_b, valve)
        if valve.holding_b != NO_HOLDING:
            flow_b = _held(flow_b, open_ > 0.0, valve.holding_b, to_b, to_a, valve)
        volume_a = cylinder.dead_volume_a_m3 + cylinder.area_a_m2 * rows.position_m[index]
        left_m = cylinder.stroke_m - rows.position_m[index]
        volume_b = cylinder.dead_volume_b_m3 + cylinder.area_b_m2 * left_m
        rate_a, rate_b = rows.rate_a_pa_s[index], rows.rate_b_pa_s[index]
        swept_a = cylinder.area_a_m2 * rows.velocity_m_s[index] + rows.leak_m3_s[index]
        swept_b = cylinder.area_b_m2 * rows.velocity_m_s[index] + rows.leak_m3_s[index]
        a[index] = flow_a - (swept_a + volume_a * rows.softness_a_1_pa[index] * rate_a)
        b[index] = flow_b + (swept_b - volume_b * rows.softness_b_1_pa[index] * rate_b)
    return a, b
