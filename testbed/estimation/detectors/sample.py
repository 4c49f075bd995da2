"""What a detector is handed, live and over a recording."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.cylinder import (
    EXTENDING,
    RETRACTING,
    Conditions,
    Cylinder,
    break_away,
    extra_friction,
    friction_value,
    oil_springs,
    piston_force,
    place_factor,
    true_pressure,
)
from testbed.estimation.live import encoder
from testbed.formats.arrays import Array
from testbed.formats.records import Record, Records, part, quantity
from testbed.laws.holding import NO_HOLDING, outlet_share
from testbed.machine.model import Axis, Machine
from testbed.machine.names import LEGS, VERTICAL
from testbed.recording.rows import DataRow
from testbed.robot.linkage import arm_of, length_of

if TYPE_CHECKING:
    from testbed.estimation.live.chain import ChainBelief


# What detectors look at beside the estimates: loads that follow from this sample's measurements,
# causal, four feet.
#
# `carried` is a load with the friction of a piston that hardly moves. The oil tells how far it
# moves, long before the encoder does: with flows Q of the valve (spool followed from the command)
# and its leaks,
#
#     dx = (k_A Q_A dt / A_A - k_B Q_B dt / A_B - dFp) / k_oil,
#     k_i = beta_i A_i^2 / V_i,   k_oil = k_A + k_B
#
# and friction follows as a spring that slips: F_f = clip(F_f + k_seal dx, -g_minus, g_plus). A foot
# that has lost more than twice the break-away force has slipped, so that its friction is known
# again, whatever it was before.


SMOOTH_S = 0.0015
"""Time constant of the pressures (E)."""
OBSERVER_RAD_S = 60.0
"""Bandwidth of the observer of speed (E)."""


class Derived(Record):
    """Loads along the vertical joints, by foot, and what they are made of."""

    carried = quantity("N", "load with the friction that the oil tells, without inertia", per=LEGS)
    balance = quantity("N", "load with no friction and no inertia", per=LEGS)
    velocity = quantity("m/s", "speed of the piston by its encoder", per=LEGS)
    published = quantity("N", "friction (5) at that speed", per=LEGS)


class OilState(Record):
    """What is known of one leg's oil and seals."""

    started = quantity("1", "1 once there was a sample")
    time = quantity("s", "since the start")
    pressure_a = quantity("Pa", "smoothed, piston side")
    pressure_b = quantity("Pa", "smoothed, rod side")
    seal = quantity("N", "friction of the seals as a spring that slips")
    spool = quantity("1", "place of the valve's spool")
    spool_rate = quantity("1/s", "its speed")
    encoder = part(encoder.EncoderState, "motion of the piston")


class Valve(Record):
    """Valve, oil and encoder as believed."""

    rated_flow = quantity("m3/s", "through an edge, full opening, rated drop")
    rated_drop = quantity("Pa", "of one edge")
    edge_pa = quantity("1", "size of the edge from supply to A")
    edge_at = quantity("1", "size of the edge from A to tank")
    edge_pb = quantity("1", "size of the edge from supply to B")
    edge_bt = quantity("1", "size of the edge from B to tank")
    natural_frequency = quantity("rad/s", "of the spool")
    damping = quantity("1", "of the spool")
    deadband = quantity("1", "overlap of the spool")
    leakage = quantity("m3/s/Pa", "from A to B")
    leakage_pa = quantity("m3/s/Pa", "of the edge from supply to A")
    leakage_at = quantity("m3/s/Pa", "of the edge from A to tank")
    leakage_pb = quantity("m3/s/Pa", "of the edge from supply to B")
    leakage_bt = quantity("m3/s/Pa", "of the edge from B to tank")
    holding_a = quantity("1", "kind of load-holding valve at A (laws/holding.py)")
    holding_b = quantity("1", "kind of load-holding valve at B")
    setting = quantity("Pa", "of a counterbalance valve")
    pilot_ratio = quantity("1", "of a counterbalance valve")
    tank_pressure = quantity("Pa", "gauge")
    encoder_resolution = quantity("m", "one count")


def valves_of(machine: Machine) -> NDArray[Any]:
    """`Valve` records (4,) of the vertical cylinders, fl, fr, rl, rr, of the believed machine."""
    return np.concatenate([_valve_of(machine, machine.axes[f"{leg}_vertical"]) for leg in LEGS])


def _valve_of(machine: Machine, axis: Axis) -> NDArray[Any]:
    v, oil = axis.valve, axis.oil
    return Valve.one(
        rated_flow=axis.rated_flow_m3_s,
        rated_drop=v.rated_drop_per_edge_pa,
        edge_pa=v.edge_pa,
        edge_at=v.edge_at,
        edge_pb=v.edge_pb,
        edge_bt=v.edge_bt,
        natural_frequency=2.0 * math.pi * v.natural_frequency_hz,
        damping=v.damping,
        deadband=v.deadband,
        leakage=oil.internal_leakage_m3_s_pa,
        leakage_pa=v.edge_pa_leakage_m3_s_pa,
        leakage_at=v.edge_at_leakage_m3_s_pa,
        leakage_pb=v.edge_pb_leakage_m3_s_pa,
        leakage_bt=v.edge_bt_leakage_m3_s_pa,
        holding_a=v.holding_a,
        holding_b=v.holding_b,
        setting=v.counterbalance_setting_pa,
        pilot_ratio=v.counterbalance_pilot_ratio,
        tank_pressure=machine.power_unit.tank_pressure_pa,
        encoder_resolution=machine.sensor.encoder_linear_m,
    )


@njit
def gravity_along(attitude: Array, gravity: float) -> float:
    """Gravity along extension of the vertical joints (-z of the body), m/s2, at roll, pitch,
    yaw.
    """
    return gravity * math.cos(attitude[1]) * math.cos(attitude[0])


@njit
def orifice(opening: float, drop_pa: float, valve: Valve) -> float:
    """Flow through an edge, m3/s: rated |o| sqrt(dp / rated drop), signed by dp."""
    size = valve.rated_flow * abs(opening) * math.sqrt(abs(drop_pa) / valve.rated_drop)
    return size if drop_pa >= 0.0 else -size


@njit
def flows(spool: float, pa: float, pb: float, supply: float, valve: Valve) -> tuple[float, float]:
    """Flow into A and into B, m3/s, from spool position, gauge pressures and leaks."""
    across, tank = valve.leakage * (pa - pb), valve.tank_pressure
    qa = valve.leakage_pa * (supply - pa) - valve.leakage_at * (pa - tank)
    qb = valve.leakage_pb * (supply - pb) - valve.leakage_bt * (pb - tank)
    opening = max(abs(spool) - valve.deadband, 0.0) / (1.0 - valve.deadband)
    if spool > 0.0:
        qa += valve.edge_pa * orifice(opening, supply - pa, valve)
        qb -= valve.edge_bt * orifice(opening, pb - tank, valve)
    else:
        qa -= valve.edge_at * orifice(opening, pa - tank, valve)
        qb += valve.edge_pb * orifice(opening, supply - pb, valve)
    if valve.holding_a != NO_HOLDING and qa < 0.0:
        opened = spool < 0.0 and opening > 0.0
        qa *= held_share(opened, valve.holding_a, pa - tank, pb - tank, valve)
    if valve.holding_b != NO_HOLDING and qb < 0.0:
        opened = spool > 0.0 and opening > 0.0
        qb *= held_share(opened, valve.holding_b, pb - tank, pa - tank, valve)
    return qa - across, qb + across


@njit
def held_share(opened: bool, kind: float, load_pa: float, pilot_pa: float, valve: Valve) -> float:
    """Share of the oil that leaves a port which a load-holding valve lets through; pressures over
    the tank's.
    """
    if not opened:
        return 0.0
    return outlet_share(kind, load_pa, pilot_pa, valve.setting, valve.pilot_ratio)


@njit
def oil_travel(
    change: tuple[float, float],
    supply: float,
    extension: float,
    state: OilState,
    c: Cylinder,
    valve: Valve,
    dt: float,
) -> float:
    """How far (m) the piston moved while the pressures changed by `change` (A, B; Pa): see the
    equations above.

    """
    pa, pb = state.pressure_a, state.pressure_b
    ka, kb = oil_springs(pa, pb, extension, c)
    qa, qb = flows(state.spool, pa, pb, supply, valve)
    fed = dt * (ka * qa / c.area_a - kb * qb / c.area_b)
    return float((fed - piston_force(change[0], change[1], c.area_a, c.area_b)) / (ka + kb))


@njit
def derive(row: DataRow, belief: ChainBelief, states: Records[OilState], out: Derived) -> None:
    """One sample: from a row with its estimates into `out`; states: (4)."""
    for leg in range(len(LEGS)):
        derive_leg(row, leg, belief, states[leg], out)


@njit
def derive_leg(row: DataRow, leg: int, belief: ChainBelief, state: OilState, out: Derived) -> None:
    """One sample of one leg; a missing pressure leaves everything as it was."""
    axis, dt, mine = VERTICAL[leg], belief.dt, belief.legs[leg]
    c, valve = mine.cylinder, mine.valve
    pa = true_pressure(row.pressure_a[axis], c.sensor_a, state.time)
    pb = true_pressure(row.pressure_b[axis], c.sensor_b, state.time)
    state.time += dt
    if not (math.isfinite(pa) and math.isfinite(pb)):
        return
    arm, command = arm_of(row.position[axis], mine.linkage), row.valve[axis]
    x = length_of(row.position[axis], mine.linkage) - mine.linkage.closed
    if state.started == 0.0:
        state.pressure_a, state.pressure_b, state.spool, state.started = pa, pb, command, 1.0
    share = min(dt / (SMOOTH_S + dt), 1.0)
    change = share * (pa - state.pressure_a), share * (pb - state.pressure_b)
    state.pressure_a += change[0]
    state.pressure_b += change[1]
    w = valve.natural_frequency
    pull = w * w * (command - state.spool) - 2.0 * valve.damping * w * state.spool_rate
    state.spool_rate += dt * pull
    state.spool += dt * state.spool_rate
    moved = oil_travel(change, row.supply_pressure, x, state, c, valve, dt)
    count = arm * valve.encoder_resolution
    encoder.observe(state.encoder, x, count, dt, OBSERVER_RAD_S)
    v = encoder.bounded_speed(state.encoder, count, belief.rest_speed)
    extra = extra_friction(c, pa + pb, row.estimate.own[leg] / arm, 0.0)
    now = Conditions(place_factor(c, x), extra, 1.0, 0.0)
    low, high = break_away(c.friction, now)
    state.seal = min(max(state.seal + c.seal_stiffness * moved, low), high)
    viscous = v * c.friction.sides[EXTENDING if v >= 0.0 else RETRACTING].viscous
    weight = mine.mass * gravity_along(row.attitude, belief.gravity)
    force = piston_force(state.pressure_a, state.pressure_b, c.area_a, c.area_b)
    balance = arm * force + weight + arm * c.offset
    out.balance[leg], out.carried[leg] = balance, balance - arm * state.seal - arm * viscous
    out.velocity[leg], out.published[leg] = v, arm * friction_value(v, c.friction, now)


class Sample(Record):
    """One sample, four feet (fl, fr, rl, rr): every column of `data` by name, and what follows from
    it.

    `sample.row.estimate.own` (4,) N, `sample.row.pressure_a` (12,) Pa, `sample.derived.carried`
    (4,) N.
    """

    row = part(DataRow, "what was measured, estimated and ordered")
    derived = part(Derived, "loads with other friction")


class Sampler:
    """Samples of a run, block by block; `belief`: the chain's, shape (1,)."""

    def __init__(self, belief: NDArray[Any]) -> None:
        self._belief, self._state = belief, OilState.zeros(len(LEGS))
        self._last = Derived.zeros()

    def samples(self, rows: NDArray[Any]) -> NDArray[Any]:
        """The next rows (n,) of DataRow, with their estimates, as `Sample` (n,); fields by name:
        `samples[k].row`.
        """
        out = Sample.zeros(len(rows))
        out["row"] = rows
        _derive_all(out, self._belief, self._state, self._last)
        return out.view(np.recarray)


@njit
def _derive_all(
    samples: Records[Sample],
    belief: Records[ChainBelief],
    state: Records[OilState],
    last: Records[Derived],
) -> None:
    for k in range(samples.shape[0]):
        derive(samples[k].row, belief[0], state, last[0])
        for leg in range(len(LEGS)):
            samples[k].derived.carried[leg] = last[0].carried[leg]
            samples[k].derived.balance[leg] = last[0].balance[leg]
            samples[k].derived.velocity[leg] = last[0].velocity[leg]
            samples[k].derived.published[leg] = last[0].published[leg]
