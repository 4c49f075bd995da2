"""Both chambers of every cylinder over one substep: a linearly implicit step of second order, oil
counted exactly.

With W the oil in a chamber (standard volume, oil.py), x the extension, q the flow through an edge:

    W_A' = q_PA + q_TA - C_i (pA - pB) - C_o (pA - pt) - hose,   W_A nu(pA) = V_A + E (pA - p0)
    W_B' = q_PB + q_TB + C_i (pA - pB) - C_o (pB - pt) - hose,   W_B nu(pB) = V_B + E (pB - p0)
    V_A = dead volume + A_A x,   V_B = dead volume + A_B (stroke - x)
    hose: capacity ph' = capacity (p - ph) / time

A hose widens at once by its elasticity E and slowly, as rubber does, by its capacity. Leakages are
laminar: they grow as the oil thins.

The step is the Rosenbrock method ROS2 (Verwer, Spee, Blom, Hundsdorfer 1999), two stages, L-stable
with g = 1 - 1 / sqrt(2):

    (1 - g h J) k1 = f(t, W) + g h f_t,   (1 - g h J) k2 = f(t + h, W + h k1) - 2 k1 - g h f_t,
    W += h (3 k1 + k2) / 2

It stays of second order for any J, so slopes are taken where they are at hand. Every flow is
followed through both stages by itself, so that what leaves one place enters another to the last
bit. Pressures follow from oil and volume after each stage. The axes meet in the supply: each first
solves for its rates as y + u q, linear in the rate q of the supply's pressure; the supply then
finds q; the axes fill it in.
"""

from __future__ import annotations

import math

from testbed.compiled import njit_law
from testbed.laws.axis_records import (
    AxisInput,
    AxisParameters,
    AxisState,
    AxisWork,
    Chamber,
    ChamberParameters,
    ChamberWork,
)
from testbed.laws.holding import NO_HOLDING, held_port
from testbed.laws.oil import (
    ATMOSPHERE_PA,
    POLYTROPIC,
    VAPOUR_PA,
    OilParameters,
    enthalpy,
    enthalpy_with_gas,
    gas_volume,
    pressure_near,
    pressure_of,
    vapour_volume,
)
from testbed.laws.orifice import port

GAMMA = 1.0 - 1.0 / math.sqrt(2.0)
"""g of ROS2, with which it is L-stable."""


@njit_law
def begin(axis: AxisState, p: AxisParameters, rod: AxisInput, h: float, work: AxisWork) -> None:
    """Fill the constants of a call for one axis, and its pressures at the start."""
    x, v = rod.extension, rod.rate
    work.a.volume = p.a.dead_volume + p.a.area * x
    work.b.volume = p.b.dead_volume + p.b.area * (p.stroke - x)
    work.a.growth, work.b.growth = p.a.area * v, -p.b.area * v
    thin = axis.leaking
    work.inner_leakage, work.outer_leakage = thin * p.inner_leakage, thin * p.outer_leakage
    held = p.a.holding.kind != NO_HOLDING or p.b.holding.kind != NO_HOLDING
    work.holding = 1.0 if held else 0.0
    work.hose_share = 1.0 / (1.0 + GAMMA * h / p.hose_time)
    work.vapour_volume = vapour_volume(p.oil.bulk_modulus, p.oil.air)
    work.inverse_bulk = 1.0 / p.oil.bulk_modulus
    begin_chamber(axis.a, p.a, p, work, work.a, thin)
    begin_chamber(axis.b, p.b, p, work, work.b, thin)
    settle(axis.a, work.a, axis.a.pressure, p.oil, work)
    settle(axis.b, work.b, axis.b.pressure, p.oil, work)


@njit_law(forceinline=True)
def begin_chamber(
    chamber: Chamber,
    own: ChamberParameters,
    p: AxisParameters,
    work: AxisWork,
    w: ChamberWork,
    leaking: float,
) -> None:
    """Hose and oil of one chamber at the start of a call; leaking: leakage over the declared
    one.
    """
    w.hose_conductance = own.hose_capacity / p.hose_time if own.hose_capacity > 0.0 else 0.0
    w.hose_start = chamber.hose_pressure
    thin = 0.0 if p.valve.locked != 0.0 else leaking
    w.leak_from_supply, w.leak_to_tank = thin * own.leak_from_supply, thin * own.leak_to_tank
    w.elasticity = own.hose_elasticity
    w.near.gas = gas_volume(chamber.pressure, p.oil.air)
    w.near.inverse_pressure, w.near.inverse_slope = inverses(
        chamber.pressure, chamber.oil, w.near.gas, work.inverse_bulk, p.oil.air, w.elasticity
    )


@njit_law(forceinline=True)
def inverses(
    p: float, oil: float, gas: float, per_bulk: float, air: float, elasticity: float
) -> tuple[float, float]:
    """1 / p and 1 / (oil dnu/dp - elasticity) at the pressure p, in one division; 0 for the latter
    in a void.
    """
    falls = elasticity * p + oil * (
        (1.0 - air) * (1.0 - (p - ATMOSPHERE_PA) * per_bulk) * per_bulk * p + gas / POLYTROPIC
    )
    both = 1.0 / (p * falls)
    return both * falls, -both * p * p if p > VAPOUR_PA else 0.0


@njit_law(forceinline=True)
def settle(
    chamber: Chamber, w: ChamberWork, guess: float, oil: OilParameters, work: AxisWork
) -> None:
    """Pressure of one chamber from its oil and volume, and what follows from it, into `chamber` and
    `w`.

    guess: where to look, Pa; w.near belongs to the pressure before.
    """
    near, air, per_bulk = chamber.pressure, oil.air, work.inverse_bulk
    room = w.volume + w.elasticity * (guess - ATMOSPHERE_PA)
    p, gas, nu, holds = pressure_near(room, chamber.oil, guess, near, w.near, per_bulk, air)
    if not holds:
        p, gas, nu = pressure_in(w, chamber.oil, guess, near, oil, work)
    per, inverse = inverses(p, chamber.oil, gas, per_bulk, air, w.elasticity)
    chamber.pressure = p
    w.near.gas, w.near.inverse_pressure, w.near.inverse_slope = gas, per, inverse
    w.stiffness, w.ramp = -nu * inverse, w.growth * inverse
    w.enthalpy = enthalpy_with_gas(p, gas, per_bulk, air)


@njit_law
def pressure_in(
    w: ChamberWork, held: float, guess: float, near: float, oil: OilParameters, work: AxisWork
) -> tuple[float, float, float]:
    """Pressure (Pa), gas volume and nu of `held` m3 of oil in a chamber, however far they moved;
    near: its last pressure.
    """
    per, widening = w.volume / held, w.elasticity / held
    p, gas, _ = pressure_of(
        per, guess, near, w.near.gas, oil.bulk_modulus, oil.air, work.vapour_volume, widening
    )
    return p, gas, per + widening * (p - ATMOSPHERE_PA)


@njit_law
def first_stage(
    axis: AxisState,
    p: AxisParameters,
    w: AxisWork,
    o: float,
    o_next: float,
    ps: float,
    pt: float,
    h: float,
) -> None:
    """Flows and slopes of one axis at the substep's start; rates as y + u q.

    Leaves in w.drawn what it draws from the supply, m3/s, and in w.rise its slope by q, the rate of
    the supply's pressure. o, o_next: the valve's openings at both ends of the substep; ps, pt:
    pressures of supply and tank, Pa.
    """
    gh = GAMMA * h
    a, b = w.a, w.b
    pa, pb, ci, co = axis.a.pressure, axis.b.pressure, w.inner_leakage, w.outer_leakage
    into_a = port(pa, ps, pt, p.a, a, o, o_next)
    into_b = port(pb, ps, pt, p.b, b, -o, -o_next)
    if w.holding != 0.0:
        into_a = held_port(into_a, pa, pb, pt, p.a, o + o_next < 0.0)
        into_b = held_port(into_b, pb, pa, pt, p.b, o + o_next > 0.0)
    out_a = into_a.supply_slope + into_a.tank_slope + ci + co
    out_b = into_b.supply_slope + into_b.tank_slope + ci + co
    # how the flows change in time at constant oil, over g h
    a.change = gh * (ci * b.ramp - out_a * a.ramp) + GAMMA * (
        into_a.supply_growth + into_a.tank_growth
    )
    b.change = gh * (ci * a.ramp - out_b * b.ramp) + GAMMA * (
        into_b.supply_growth + into_b.tank_growth
    )
    change = GAMMA * (into_a.supply_growth + into_b.supply_growth) - gh * (
        into_a.supply_slope * a.ramp + into_b.supply_slope * b.ramp
    )
    a.hose_in = w.hose_share * a.hose_conductance * (pa - axis.a.hose_pressure + gh * a.ramp)
    b.hose_in = w.hose_share * b.hose_conductance * (pb - axis.b.hose_pressure + gh * b.ramp)
    cross = ci * (pa - pb)
    ra = into_a.supply + into_a.tank - cross - co * (pa - pt) + a.change - a.hose_in
    rb = into_b.supply + into_b.tank + cross - co * (pb - pt) + b.change - b.hose_in
    ga, gb = gh * a.stiffness, gh * b.stiffness
    maa = 1.0 + ga * (out_a + w.hose_share * a.hose_conductance)
    mbb = 1.0 + gb * (out_b + w.hose_share * b.hose_conductance)
    inverse = 1.0 / (maa * mbb - ga * gb * ci * ci)
    a.own_share, a.other_share = mbb * inverse, gb * ci * inverse
    b.own_share, b.other_share = maa * inverse, ga * ci * inverse
    esa, esb = into_a.supply_slope, into_b.supply_slope
    a.answer = gh * (a.own_share * esa + a.other_share * esb)
    b.answer = gh * (b.other_share * esa + b.own_share * esb)
    a.rate = a.own_share * ra + a.other_share * rb
    b.rate = b.other_share * ra + b.own_share * rb
    a.from_supply, b.from_supply = gh * esa, gh * esb
    w.first_drawn = change  # kept for the second stage
    w.drawn = (
        into_a.supply
        + into_b.supply
        + change
        - a.from_supply * a.stiffness * a.rate
        - b.from_supply * b.stiffness * b.rate
    )
    w.rise = a.from_supply * (1.0 - a.stiffness * a.answer) + b.from_supply * (
        1.0 - b.stiffness * b.answer
    )


@njit_law
def second_stage(
    axis: AxisState,
    p: AxisParameters,
    w: AxisWork,
    o: float,
    q: float,
    ps: float,
    pt: float,
    h: float,
) -> None:
    """Fill in q, then the flows of one axis at the substep's end on the first stage's prediction;
    see `first_stage`.

    o: the valve's opening there; ps: pressure of the supply there, Pa.
    """
    gh = GAMMA * h
    a, b = w.a, w.b
    ka, kb = a.rate + a.answer * q, b.rate + b.answer * q
    kha = a.hose_in + w.hose_share * a.hose_conductance * gh * a.stiffness * ka
    khb = b.hose_in + w.hose_share * b.hose_conductance * gh * b.stiffness * kb
    drawn = w.drawn + w.rise * q
    pa = predicted(axis.a, a, ka, h, p.oil, w)
    pb = predicted(axis.b, b, kb, h, p.oil, w)
    a.guess, b.guess = pa, pb
    ci, co = w.inner_leakage, w.outer_leakage
    into_a = port(pa, ps, pt, p.a, a, o, o)
    into_b = port(pb, ps, pt, p.b, b, -o, -o)
    if w.holding != 0.0:
        into_a = held_port(into_a, pa, pb, pt, p.a, o < 0.0)
        into_b = held_port(into_b, pb, pa, pt, p.b, o > 0.0)
    a.hose_in = second_hose_flow(axis.a, p.a, a, w, pa, kha, h)
    b.hose_in = second_hose_flow(axis.b, p.b, b, w, pb, khb, h)
    cross = ci * (pa - pb)
    ra = (
        into_a.supply
        + into_a.tank
        - cross
        - co * (pa - pt)
        - 2.0 * (ka + kha)
        - a.change
        - a.hose_in
    )
    rb = (
        into_b.supply
        + into_b.tank
        + cross
        - co * (pb - pt)
        - 2.0 * (kb + khb)
        - b.change
        - b.hose_in
    )
    a.rate = a.own_share * ra + a.other_share * rb
    b.rate = b.other_share * ra + b.own_share * rb
    w.drawn = (
        into_a.supply
        + into_b.supply
        - 2.0 * drawn
        - w.first_drawn
        - a.from_supply * a.stiffness * a.rate
        - b.from_supply * b.stiffness * b.rate
    )
    a.first_rate, b.first_rate = ka, kb
    a.first_hose_rate, b.first_hose_rate, w.first_drawn = kha, khb, drawn


@njit_law(forceinline=True)
def second_hose_flow(
    chamber: Chamber,
    own: ChamberParameters,
    w: ChamberWork,
    work: AxisWork,
    p: float,
    first: float,
    h: float,
) -> float:
    """Flow into a chamber's hose in the second stage, m3/s, without what its rate adds; p:
    predicted, Pa.
    """
    hose = chamber.hose_pressure
    if w.hose_conductance > 0.0:
        hose += h * first / own.hose_capacity
    return work.hose_share * (w.hose_conductance * (p - hose - GAMMA * h * w.ramp) - 2.0 * first)


@njit_law(forceinline=True)
def predicted(
    chamber: Chamber, w: ChamberWork, rate: float, h: float, oil: OilParameters, work: AxisWork
) -> float:
    """Pressure of a chamber at the substep's end if the rate of its oil holds, Pa; its volume
    advances.
    """
    w.volume += h * w.growth
    near = chamber.pressure
    then = chamber.oil + h * rate
    guess = near + h * (w.stiffness * rate + w.ramp)
    room = w.volume + w.elasticity * (guess - ATMOSPHERE_PA)
    p, _, _, holds = pressure_near(room, then, guess, near, w.near, work.inverse_bulk, oil.air)
    if not holds:
        p, _, _ = pressure_in(w, then, guess, near, oil, work)
    return p


@njit_law(forceinline=True)
def close_chamber(
    chamber: Chamber,
    own: ChamberParameters,
    w: ChamberWork,
    work: AxisWork,
    q: float,
    h: float,
    oil: OilParameters,
) -> tuple[float, float, float]:
    """Fill in the second q and move a chamber's oil: oil that entered, its heat content (J), oil
    into the hose.
    """
    rate = w.rate + w.answer * q
    hose_rate = w.hose_in + work.hose_share * w.hose_conductance * (GAMMA * h) * w.stiffness * rate
    into = 0.5 * h * (3.0 * w.first_rate + rate)
    hose = 0.5 * h * (3.0 * w.first_hose_rate + hose_rate)
    if w.hose_conductance > 0.0:
        chamber.hose_pressure += hose / own.hose_capacity
    chamber.oil += into
    was = w.enthalpy
    # The second stage corrects the first by k1 + k2: start looking from there.
    settle(chamber, w, w.guess + 0.5 * h * w.stiffness * (w.first_rate + rate), oil, work)
    return into, into * (0.5 * (was + w.enthalpy)), hose


@njit_law
def close_step(
    axis: AxisState,
    p: AxisParameters,
    w: AxisWork,
    q: float,
    supply_enthalpy: float,
    tank_enthalpy: float,
    h: float,
) -> tuple[float, float]:
    """Fill in the second q and move the oil of one axis; its pressures are then those at the
    substep's end.

    supply_enthalpy: mean of the drawn oil, J/m3. Returns the oil returned to the tank (m3) and heat
    (J; what
    hoses keep is still in it: `kept_by_hoses`).
    """
    drawn = 0.5 * h * (3.0 * w.first_drawn + w.drawn + w.rise * q)
    into_a, heat_a, hose_a = close_chamber(axis.a, p.a, w.a, w, q, h, p.oil)
    into_b, heat_b, hose_b = close_chamber(axis.b, p.b, w.b, w, q, h, p.oil)
    returned = drawn - into_a - into_b - hose_a - hose_b
    heat = drawn * supply_enthalpy - returned * tank_enthalpy - (heat_a + heat_b)
    return returned, heat


@njit_law(forceinline=True)
def kept_by_hoses(axis: AxisState, p: AxisParameters, w: AxisWork) -> float:
    """Energy that the hoses of one axis took in since `begin`, J."""
    return kept_by_hose(axis.a, p.a, w.a, p.oil) + kept_by_hose(axis.b, p.b, w.b, p.oil)


@njit_law(forceinline=True)
def kept_by_hose(
    chamber: Chamber, own: ChamberParameters, w: ChamberWork, oil: OilParameters
) -> float:
    """Energy that the hose of one chamber took in since `begin`, J."""
    if w.hose_conductance <= 0.0:
        return 0.0
    middle = 0.5 * (chamber.hose_pressure + w.hose_start)
    return (
        own.hose_capacity
        * (chamber.hose_pressure - w.hose_start)
        * enthalpy(middle, oil.bulk_modulus, oil.air)
    )
