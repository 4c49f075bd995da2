"""The estimators of a run, live on all four feet, compiled: pressures -> cylinder force -> foot
load -> filters -> contact state. `own` is the testbed's estimate, the others are the paper's.

    one_chamber  = pA A_A                                                     (1)
    two_chamber  = pA A_A - pB A_B                                            (3)
    friction     = pA A_A - pB A_B - F_f(v) + m g cos(inclination) - m a      (7) with (5)
    kbf, modified_kbf = the paper's filters on `friction`                     (6)
    own          = the same balance with friction as a set at rest (friction_at_rest.py names the
                   likeliest value in it), through a gate that cannot lock out; where the whole
                   machine is believed (body_belief.py), from all twelve cylinders and the body's
                   balance (whole_body.py), with the foot's force in three axes

All in N along the vertical joint's axis, positive when the ground pushes the foot up. pA, pB: the
chambers' pressures, Pa; A_A, A_B: areas of piston and ring, m2; v, a: speed and acceleration of the
rod; m: the mass that moves with it, kg; F_f: friction of rod and seals, N. Numbers in brackets are
the paper's equations.

`step_chain` is one compiled call a step for all four legs, on the row that has just been measured;
`EstimatorChain` keeps belief and state for it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.errors import InputError
from testbed.estimation.cylinder import (
    EXTENDING,
    RETRACTING,
    Conditions,
    Cylinder,
    extra_friction,
    friction_set,
    friction_value,
    piston_force,
    place_factor,
    seal_ratio,
    thinning_by_warmth,
    true_pressure,
    valve_direction,
)
from testbed.estimation.detectors.combined import CombinedNumbers, CombinedState, Held, step_on
from testbed.estimation.detectors.sample import (
    Derived,
    OilState,
    Valve,
    derive_leg,
    gravity_along,
)
from testbed.estimation.filters import kbf, modified_kbf, persistent
from testbed.estimation.filters.kbf import KalmanState
from testbed.estimation.live import contact, encoder, friction_at_rest
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.body_records import BodyBelief, BodyState
from testbed.estimation.live.contact import limits_at
from testbed.estimation.live.whole_body import step_body
from testbed.formats.arrays import Array
from testbed.formats.intervals import Z90
from testbed.formats.records import Record, Records, from_columns, part, quantity
from testbed.machine.names import LEGS, VERTICAL
from testbed.recording.rows import DataRow
from testbed.robot.linkage import Linkage, arm_of, length_of


class LegBelief(Record):
    """What is believed of a vertical cylinder and what it carries."""

    cylinder = part(Cylinder, "cylinder, seals, sensors")
    linkage = part(Linkage, "from joint to rod")
    mass = quantity("kg", "what moves with it")
    valve = part(Valve, "valve and oil")


class ChainBelief(Record):
    """Everything that the chain is built from."""

    dt = quantity("s", "step")
    gravity = quantity("m/s2", "strength")
    encoder_resolution = quantity("m", "one count")
    observer = quantity("rad/s", "bandwidth of the encoders' observer")
    rest_speed = quantity("m/s", "slower than this a piston stands still")
    slide_speed = quantity("m/s", "faster than this it surely slides")
    pressure_sd = quantity("Pa", "accuracy of a pressure sensor")
    friction_share = quantity("1", "sliding friction is known to this share")
    speed_sd = quantity("m/s", "standard deviation of the speed")
    acceleration_sd = quantity("m/s2", "standard deviation of the acceleration")
    filter = part(persistent.Numbers, "of the filters")
    contact = part(contact.ContactLimits, "of the contact state")
    combined = part(CombinedNumbers, "of the detector")
    legs = part(LegBelief, "vertical cylinders", per=LEGS)
    body = part(BodyBelief, "the whole machine")


class LegState(Record):
    """What is known of one leg."""

    time = quantity("s", "since the start")
    slid = quantity("1", "how surely it slid at the last sample")
    encoder = part(encoder.EncoderState, "motion")
    rest = part(friction_at_rest.RestMemory, "memory of friction at rest")
    kbf = part(KalmanState, "the published filter")
    modified_kbf = part(KalmanState, "the published modified filter")
    own = part(persistent.PersistentState, "the own filter")
    contact = part(contact.ContactState, "contact state")
    combined = part(CombinedState, "the detector")
    oil = part(OilState, "oil and seals")


class ChainState(Record):
    """What the chain remembers."""

    legs = part(LegState, "vertical cylinders", per=LEGS)
    derived = part(Derived, "what the detector looks at")
    body = part(BodyState, "the whole machine")


@njit
def step_leg(row: DataRow, leg: int, belief: ChainBelief, state: LegState) -> None:
    """One leg, one step, from the measured part of `row` to its estimates; `state` moves on.

    Corrects the pressures for believed sensor errors first; published columns (1), (3) use them
    corrected too. Friction and oil are the rod's; `arm`, the rod's way by the joint's, turns its
    forces into the foot's.
    """
    axis, dt = VERTICAL[leg], belief.dt
    mine = belief.legs[leg]
    c, seen, estimate = mine.cylinder, state.encoder, row.estimate
    pa = true_pressure(row.pressure_a[axis], c.sensor_a, state.time)
    pb = true_pressure(row.pressure_b[axis], c.sensor_b, state.time)
    state.time += dt
    arm = arm_of(row.position[axis], mine.linkage)
    count = arm * belief.encoder_resolution
    reading = length_of(row.position[axis], mine.linkage) - mine.linkage.closed
    encoder.observe(seen, reading, count, dt, belief.observer)
    v = encoder.bounded_speed(seen, count, belief.rest_speed)
    slides = encoder.sliding(seen, count, belief.rest_speed, belief.slide_speed)
    x, a = seen.extension, seen.acceleration
    extra = extra_friction(c, pa + pb, state.own.estimate.value / arm, 0.0)
    thinning = thinning_by_warmth(c, row.oil_temperature)
    now = Conditions(place_factor(c, x), extra, thinning, 0.0)
    piston = piston_force(pa, pb, c.area_a, c.area_b)
    weight = mine.mass * (gravity_along(row.attitude, belief.gravity) - a / arm)
    balance = arm * piston + weight + arm * c.offset
    balance += arm * (
        c.cushion_stiffness * max(c.cushion_start - x, 0.0)
        - c.spring_stiffness * (x - c.spring_rest)
    )
    simple = balance - arm * friction_value(v, c.friction, now)
    low, high = friction_set(v, seen.sense, slides, c.friction, now)
    if slides > 0.0 and state.slid == 0.0:
        state.own.lively = 1.0  # the set has just collapsed: what follows is news, not a spike
    state.slid = slides
    ratio = seal_ratio(pa, pb, x, c)
    push = valve_direction(row.valve[axis], c.deadband)
    friction = friction_at_rest.step(state.rest, piston, low, high, slides, push, ratio, belief.dt)
    estimate.one_chamber[leg], estimate.two_chamber[leg] = arm * pa * c.area_a, arm * piston
    estimate.friction[leg] = simple
    estimate.kbf[leg] = kbf.step(state.kbf, simple, belief.filter)
    estimate.modified_kbf[leg] = modified_kbf.step(state.modified_kbf, simple, belief.filter)
    own = persistent.step(state.own, balance - arm * friction, belief.filter)
    of_rod = arm**2 * rod_variance(high - low, v, thinning, c, belief)
    inertia = (mine.mass * belief.acceleration_sd) ** 2
    sd = math.sqrt(of_rod + inertia + state.own.estimate.variance)
    least = min(balance - arm * high, own - Z90 * sd)
    most = max(balance - arm * low, own + Z90 * sd)
    tell_own(row, leg, own, (least, most, sd))


@njit
def tell_own(row: DataRow, leg: int, load: float, interval: tuple[float, float, float]) -> None:
    """Write one vertical cylinder's own estimate, N, into the row; `interval`: low, high, standard
    deviation.

    The interval holds both the set of what friction may hide and the estimate with its spread.
    """
    low, high, sd = interval
    row.estimate.own[leg] = row.own.z[leg] = load
    row.estimate_own.low[leg], row.estimate_own.high[leg] = low, high
    row.estimate_own.sd[leg] = row.estimate_own.spread[leg] = row.own.z_sd[leg] = sd
    row.own.x[leg] = row.own.y[leg] = row.own.x_sd[leg] = row.own.y_sd[leg] = 0.0


@njit
def rod_variance(
    width: float, v: float, thinning: float, c: Cylinder, belief: ChainBelief
) -> float:
    """Of the rod's force less friction, N2: sensors' accuracy through the areas, friction's
    uncertainty, speed, the set's width.

    At rest friction spreads over its set by friction_at_rest.SPREAD of the half width.
    """
    out, back = c.friction.sides[EXTENDING], c.friction.sides[RETRACTING]
    sensors = belief.pressure_sd**2 * (c.area_a**2 + c.area_b**2)
    slope = (out.viscous if v >= 0.0 else back.viscous) * thinning
    level = belief.friction_share * 0.5 * (out.coulomb + back.coulomb)
    friction = level**2 + (slope * belief.speed_sd) ** 2
    rest = (0.5 * friction_at_rest.SPREAD * width) ** 2
    return sensors + friction + rest


@njit
def step_chain(row: DataRow, belief: ChainBelief, state: ChainState) -> None:
    """All four legs, one step: reads the measured part of `row`, writes its estimates and contact
    states.

    Attitude, rates, specific force, ropes, stance and what the drill's controls know serve the
    whole body's balance, where one is believed. The vertical joints extend along -z of the body.
    """
    for leg in range(4):
        step_leg(row, leg, belief, state.legs[leg])
    if belief.body.believed != 0.0:
        step_body(row, belief.body, state.body)
    for leg in range(4):
        derive_leg(row, leg, belief, state.legs[leg].oil, state.derived)
        mine, own = state.legs[leg], row.estimate.own[leg]
        score = step_on(own, state.derived, leg, belief.combined, mine.combined, belief.dt)
        row.contact[leg] = contact.step(mine.contact, -score, belief.dt, belief.contact)


@njit
def replay_chain(
    rows: Records[DataRow], belief: Records[ChainBelief], state: Records[ChainState]
) -> None:
    """`step_chain` over rows (n,); belief and state of shape (1,)."""
    for index in range(rows.shape[0]):
        step_chain(rows[index], belief[0], state[0])


OIL_DEGC = 20.0
"""The oil's temperature where it is not recorded."""
NEEDED = (
    *(
        f"{stem}_{leg}_vertical"
        for stem in ("position", "pressure_a", "pressure_b")
        for leg in LEGS
    ),
    "attitude_roll",
    "attitude_pitch",
)
"""Columns without which nothing can be estimated."""


class EstimatorChain:
    """The estimators of a run: `step` once per control period, on the running row.

    `belief` (ChainBelief) and `state` (ChainState), both of shape (1,), serve a compiled caller of
    `step_chain`.
    """

    def __init__(self, believed: Believed) -> None:
        self.believed, self.belief = believed, belief_of(believed)
        self.state = ChainState.zeros()

    def forget(self) -> None:
        """Forget everything seen so far."""
        self.state[:] = 0

    def step(self, rows: NDArray[Any]) -> None:
        """One period: fill the estimates of DataRow `rows` (1,) from what is measured there."""
        replay_chain(rows, self.belief, self.state)


def belief_of(believed: Believed) -> NDArray[Any]:
    """What the compiled step believes: one record `ChainBelief`, shape (1,)."""
    t, out = believed.tuning, ChainBelief.zeros()
    belief = out[0]
    belief["dt"], belief["gravity"] = believed.dt_s, believed.gravity_m_s2
    belief["encoder_resolution"] = believed.encoder_resolution_m
    belief["observer"] = t.observer_rad_s
    belief["rest_speed"], belief["slide_speed"] = t.rest_m_s, t.slide_m_s
    belief["pressure_sd"], belief["friction_share"] = t.pressure_sd_pa, t.friction_sd_share
    belief["speed_sd"], belief["acceleration_sd"] = t.speed_sd_m_s, t.acceleration_sd_m_s2
    belief["filter"] = persistent.Numbers.one(
        process_variance=t.kbf_q_n2,
        measurement_variance=t.kbf_r_n2,
        innovation_limit=t.e_max_n,
        hold_samples=t.hold_samples,
    )[0]
    belief["contact"] = limits_at(-t.contact_off_n, t.contact_hold)[0]
    numbers = Held.numbers | {"break_away": t.break_away_n}
    belief["combined"] = CombinedNumbers.one(**numbers)[0]
    belief["legs"]["linkage"] = believed.linkages
    for record, leg, valve in zip(belief["legs"], believed.legs, believed.valves, strict=True):
        leg.write(record["cylinder"])
        record["valve"] = valve
        record["mass"] = leg.moving_mass_kg
    if believed.body is not None:
        belief["body"] = believed.body[0]
    return out


def rows_of(columns: Mapping[str, Array], believed: Believed) -> NDArray[Any]:
    """A whole-robot recording's columns (n rows each) as DataRow records (n,), without estimates.

    Needs NEEDED, and the valve commands of all legs or of none; takes oil temperature, supply
    pressure, ropes, rates, stance and what the drill's controls know where they are there. Raises
    InputError naming the column that is missing.
    """
    valves = tuple(f"valve_{leg}_vertical" for leg in LEGS)
    for name in NEEDED + (valves if any(valve in columns for valve in valves) else ()):
        if name not in columns:
            raise InputError("the recording has no such column", field=name)
    measured = {name: values for name, values in columns.items() if name not in ESTIMATED}
    rows = from_columns(
        DataRow,
        measured,
        len(columns["attitude_roll"]),
        oil_temperature=OIL_DEGC,
        supply_pressure=believed.supply_pa,
        carrying=1.0,
    )
    if "specific_force_x" not in columns:  # at rest
        roll, pitch = rows["attitude"][:, 0], rows["attitude"][:, 1]
        along = believed.gravity_m_s2 * np.cos(pitch)
        rows["specific_force"][:, 0] = -believed.gravity_m_s2 * np.sin(pitch)
        rows["specific_force"][:, 1] = along * np.sin(roll)
        rows["specific_force"][:, 2] = along * np.cos(roll)
    return rows


ESTIMATED = frozenset(
    name for name in DataRow.column_names() if name.startswith(("estimate_", "own_", "contact_"))
)
"""Columns that the chain fills."""
