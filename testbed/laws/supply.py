"""Power unit: pressure-compensated pump with flow and power limit, relief valve, accumulator, tank,
warming oil.

Oil in line and accumulator, standard volume: W = (line volume + accumulator(p)) / nu(p), and

    W'      = pump - drawn by the axes - traction - relief - leakage
              (+ make-up from the tank below its pressure)
    stroke' = (wanted(p) - stroke) / lag,  wanted = 1 at the demand less the band, 0 at the demand
    pump    = min(stroke * full flow, power / enthalpy rise)
    droop'  = (-droop - by flow * drawn) / time,  what the valves see is p + droop

What pressure the pump works towards, its demand, is the kind of supply (`demand_step`): constant;
load-sensing, the highest load pressure behind an open port and a margin; unloading, which charges
up to the set pressure at full stroke and then circulates at none until the pressure has fallen by a
band.
"""

from __future__ import annotations

import math

from testbed.compiled import njit_law
from testbed.formats.records import Record, Records, part, quantity
from testbed.laws.chamber import GAMMA
from testbed.laws.oil import VAPOUR_PA, OilParameters, enthalpy, specific_volume

CONSTANT, LOAD_SENSING, UNLOADING = 0.0, 1.0, 2.0
"""Kinds of supply."""
TRACTION_BAND_PA = 1.0e5
"""Over this much above the tank the traction devices fade in: nothing is drawn from an empty
line.
"""


class PowerUnit(Record):
    """Pump with compensator and power limit, relief valve, accumulator, tank. Pressures are
    absolute.
    """

    pump_on = quantity("1", "1: the pump runs, 0: it stands")
    pump_flow = quantity("m3/s", "flow at full stroke")
    pump_power = quantity("W", "what the motor can give")
    kind = quantity("1", "0: constant pressure, 1: load-sensing, 2: unloading")
    set_pressure = quantity("Pa", "highest pressure at which the compensator takes all stroke back")
    margin = quantity("Pa", "load-sensing: demand above the highest load pressure")
    standby = quantity("Pa", "load-sensing: demand while no port is open")
    sensing_lag = quantity("s", "load-sensing: time constant of the demand")
    unloading_band = quantity("Pa", "unloading: fall of pressure after which it charges again")
    compensator_band = quantity("Pa", "below it, over which it does so")
    compensator_lag = quantity("s", "time constant of the stroke")
    case_leakage = quantity("m3/(s Pa)", "from the line to the tank")
    relief_pressure = quantity("Pa", "pressure at which the relief valve opens")
    relief_slope = quantity("m3/(s Pa)", "how it opens further, and the suction check valve")
    accumulator_volume = quantity("m3", "of the bladder accumulator")
    accumulator_precharge = quantity("Pa", "of its gas")
    line_volume = quantity("m3", "of the supply line")
    tank_pressure = quantity("Pa", "in the tank")
    oil = part(OilParameters, "in line and accumulator")
    heat_capacity = quantity("J/K", "of the oil with what warms with it")
    cooling = quantity("W/K", "of the tank against the air")
    ambient = quantity("degC", "of the air")
    viscosity_rate = quantity("1/K", "how viscous friction falls with the oil's temperature")
    viscosity_reference = quantity("degC", "temperature at which friction is as declared")
    declared_at = quantity("degC", "oil temperature at which leakages are as declared")
    droop = quantity("Pa s/m3", "undeclared drop of the valves' pressure by the flow drawn")
    droop_time = quantity("s", "its time constant")


class SupplyState(Record):
    """The oil between pump and valves, and what has been counted since the start."""

    oil = quantity("m3", "in line and accumulator, standard volume")
    pressure = quantity("Pa", "of the line, absolute")
    demand = quantity("Pa", "pressure that the pump works towards, absolute")
    droop = quantity("Pa", "what the valves see beyond it, <= 0")
    pump_stroke = quantity("1", "of the pump, 0 to 1")
    tank_oil = quantity("m3", "in the tank, standard volume")
    temperature = quantity("degC", "of the oil")
    traction_flow = quantity("m3/s", "that the traction devices ask for")
    traction_load = quantity("Pa", "load pressure of the traction devices that haul, gauge")
    relief_flow = quantity("m3/s", "through relief valve and case leakage, now")
    pump_power = quantity("W", "that the pump puts in, mean over the last call")
    pump_work = quantity("J", "that it has put in")
    traction_work = quantity("J", "that the traction devices took out")
    loss = quantity("J", "that has turned into heat")
    throughput = quantity("m3", "that the pump has moved")
    time = quantity("s", "since the start")


class SupplyWork(Record):
    """Working numbers of the unit within one call; rates are those of the first stage."""

    pumped_rate = quantity("m3/s", "from the pump")
    relief_rate = quantity("m3/s", "to the tank, at the substep's start")
    traction_rate = quantity("m3/s", "to the traction devices")
    oil_rate = quantity("m3/s", "of the oil in the line")
    droop_rate = quantity("Pa/s", "of the droop")
    relieved_rate = quantity("m3/s", "to the tank")
    stroke_rate = quantity("1/s", "of the pump's stroke")
    stiffness = quantity("Pa/m3", "of the line")
    relief_gain = quantity("m3/(s Pa)", "slope of the flow to the tank")
    reach = quantity("Pa/m3", "how the line's pressure answers a flow within the stage")
    droop_reach = quantity("1", "how the droop does")
    enthalpy = quantity("J/m3", "of the oil in the line")
    tank_enthalpy = quantity("J/m3", "of the oil in the tank")
    drawn = quantity("m3/s", "by the valves, in the first stage")
    pumped = quantity("m3", "in this call")
    work_done = quantity("J", "by the pump in this call")
    relieved = quantity("m3", "in this call")
    pulled = quantity("m3", "by the traction devices in this call")


@njit_law
def accumulator(p_pa: float, volume_m3: float, precharge_pa: float) -> tuple[float, float]:
    """Oil in a bladder accumulator (m3, isothermal gas: V0 (1 - p0 / p)) and its derivative by p; 0
    below precharge.
    """
    if p_pa <= precharge_pa:
        return 0.0, 0.0
    ratio = precharge_pa / p_pa
    return volume_m3 * (1.0 - ratio), volume_m3 * ratio / p_pa


@njit_law
def supply_oil_slope(p_pa: float, unit: PowerUnit) -> tuple[float, float]:
    """Standard volume of oil in line and accumulator at the absolute pressure p, m3, and its slope
    by p.
    """
    nu, dnu = specific_volume(p_pa, unit.oil.bulk_modulus, unit.oil.air)
    acc, dacc = accumulator(p_pa, unit.accumulator_volume, unit.accumulator_precharge)
    oil = (unit.line_volume + acc) / nu
    return oil, (dacc - oil * dnu) / nu


@njit_law
def supply_oil(p_pa: float, unit: PowerUnit) -> float:
    """Standard volume of oil in line and accumulator at the absolute pressure p, m3."""
    oil, _ = supply_oil_slope(p_pa, unit)
    return oil


@njit_law
def supply_pressure(oil: float, guess_pa: float, unit: PowerUnit) -> tuple[float, float]:
    """Absolute pressure (Pa) of the line that holds `oil`, and its slope by oil (Pa/m3); vapour
    pressure if empty.
    """
    p = guess_pa if guess_pa > VAPOUR_PA else VAPOUR_PA
    low, high, slope = VAPOUR_PA, math.inf, 1.0
    for _ in range(100):
        there, slope = supply_oil_slope(p, unit)
        if there < oil:
            low = p
        elif p <= VAPOUR_PA:
            return VAPOUR_PA, 0.0
        else:
            high = p
        new = p + (oil - there) / slope
        if -1e-7 * p < new - p < 1e-7 * p:
            return new, 1.0 / slope
        # The precharge is a kink: Newton's step may jump to and fro across it, so halve what
        # encloses the root.
        limit = 0.5 * (low + high) if high < math.inf else 2.0 * p + 1.0e6
        p = new if low < new < (high if high < math.inf else limit) else limit
    return p, 1.0 / slope


@njit_law
def pump(stroke: float, rise_j_m3: float, unit: PowerUnit) -> float:
    """Flow of the pump, standard m3/s: its stroke's, or what the power allows at this rise of
    enthalpy.
    """
    flow = stroke * unit.pump_flow * unit.pump_on
    if flow * rise_j_m3 > unit.pump_power:
        return unit.pump_power / rise_j_m3
    return flow


@njit_law
def demand_step(s: SupplyState, unit: PowerUnit, load_pa: float, dt: float) -> None:
    """Advance the demand by dt; load_pa: highest pressure behind an open port, absolute, 0 where
    none is open.
    """
    if unit.kind == CONSTANT:
        s.demand = unit.set_pressure
    elif unit.kind == LOAD_SENSING:
        wanted = load_pa + unit.margin if load_pa > 0.0 else 0.0
        wanted = min(max(wanted, unit.standby), unit.set_pressure)
        s.demand += (wanted - s.demand) * (1.0 - math.exp(-dt / unit.sensing_lag))
    elif s.pressure >= unit.set_pressure:
        s.demand = unit.tank_pressure
    elif s.pressure <= unit.set_pressure - unit.unloading_band:
        s.demand = unit.set_pressure + unit.compensator_band


@njit_law
def wanted_stroke(p_pa: float, demand_pa: float, unit: PowerUnit) -> float:
    """What the compensator asks for, 0..1."""
    wanted = (demand_pa - p_pa) / unit.compensator_band
    return 0.0 if wanted < 0.0 else (1.0 if wanted > 1.0 else wanted)


@njit_law
def relief(p_pa: float, unit: PowerUnit) -> tuple[float, float]:
    """Flow to the tank through relief valve and case leakage (negative: made up from the tank),
    m3/s, and its slope.
    """
    flow, slope = unit.case_leakage * (p_pa - unit.tank_pressure), unit.case_leakage
    over = p_pa - unit.relief_pressure
    under = p_pa - unit.tank_pressure
    if over > 0.0:
        flow, slope = flow + unit.relief_slope * over, slope + unit.relief_slope
    elif under < 0.0:  # the suction check valve opens
        flow, slope = flow + unit.relief_slope * under, slope + unit.relief_slope
    return flow, slope


@njit_law
def traction(p_pa: float, s: SupplyState, unit: PowerUnit) -> float:
    """What the traction devices take, m3/s."""
    above = (p_pa - unit.tank_pressure) / TRACTION_BAND_PA
    return s.traction_flow * (0.0 if above < 0.0 else (1.0 if above > 1.0 else above))


@njit_law
def begin_supply(s: SupplyState, unit: PowerUnit, works: Records[SupplyWork]) -> None:
    """Clear a call's totals; slope and enthalpy at its start."""
    w = works[0]
    w.pumped = w.work_done = w.relieved = w.pulled = w.drawn = 0.0
    w.tank_enthalpy = enthalpy(unit.tank_pressure, unit.oil.bulk_modulus, unit.oil.air)
    s.pressure, w.stiffness = supply_pressure(s.oil, s.pressure, unit)
    w.enthalpy = enthalpy(s.pressure, unit.oil.bulk_modulus, unit.oil.air)


@njit_law
def supply_first(
    s: SupplyState, unit: PowerUnit, works: Records[SupplyWork], drawn: float, rise: float, h: float
) -> tuple[float, float]:
    """First stage of the unit: the rate q of the valves' supply pressure (Pa/s) and that pressure
    at the end (Pa).

    `drawn` and `rise`: the axes draw drawn + rise q (chamber.first_stage); works: (1).
    """
    w = works[0]
    gh = GAMMA * h
    p = s.pressure
    w.pumped_rate = pump(s.pump_stroke, w.enthalpy - w.tank_enthalpy, unit)
    w.relief_rate, w.relief_gain = relief(p, unit)
    w.traction_rate = traction(p, s, unit)
    rate = w.pumped_rate - w.relief_rate - w.traction_rate
    stiff = w.stiffness
    # An accumulator that empties within this substep leaves a line a hundred times stiffer: take
    # that slope.
    _, ahead = supply_pressure(s.oil + h * (rate - drawn), p + h * stiff * (rate - drawn), unit)
    w.stiffness = stiff = ahead if ahead > stiff else stiff
    w.reach = stiff / (1.0 + gh * w.relief_gain * stiff)
    w.droop_reach = 1.0 / (1.0 + gh / unit.droop_time)
    droop = unit.droop / unit.droop_time
    sag = -s.droop / unit.droop_time
    q = (w.reach * (rate - drawn) + w.droop_reach * (sag - droop * drawn)) / (
        1.0 + (w.reach + w.droop_reach * droop) * rise
    )
    taken = drawn + rise * q
    w.oil_rate = (rate - taken) / (1.0 + gh * w.relief_gain * stiff)
    w.droop_rate = w.droop_reach * (sag - droop * taken)
    w.relieved_rate = w.relief_rate + gh * w.relief_gain * stiff * w.oil_rate
    w.stroke_rate = (wanted_stroke(p, s.demand, unit) - s.pump_stroke) / (unit.compensator_lag + gh)
    w.drawn = taken
    ahead_pa, _ = supply_pressure(s.oil + h * w.oil_rate, p + h * stiff * w.oil_rate, unit)
    return q, ahead_pa


@njit_law
def supply_second(
    s: SupplyState,
    unit: PowerUnit,
    works: Records[SupplyWork],
    ahead_pa: float,
    drawn: float,
    rise: float,
    h: float,
) -> float:
    """Second stage: returns the second q; oil, pressure, stroke, droop and totals advance."""
    w = works[0]
    gh = GAMMA * h
    bulk, air = unit.oil.bulk_modulus, unit.oil.air
    rise_1 = w.enthalpy - w.tank_enthalpy
    rise_2 = enthalpy(ahead_pa, bulk, air) - w.tank_enthalpy
    stroke = s.pump_stroke + h * w.stroke_rate
    pumped = pump(stroke, rise_2, unit)
    relieved, _ = relief(ahead_pa, unit)
    pulled = traction(ahead_pa, s, unit)
    droop = unit.droop / unit.droop_time
    sag = -(s.droop + h * w.droop_rate) / unit.droop_time - 2.0 * (w.droop_rate + droop * w.drawn)
    rate = pumped - relieved - pulled - 2.0 * (w.oil_rate + w.drawn)
    q = (w.reach * (rate - drawn) + w.droop_reach * (sag - droop * drawn)) / (
        1.0 + (w.reach + w.droop_reach * droop) * rise
    )
    taken = drawn + rise * q
    slack = gh * w.relief_gain * w.stiffness
    ks = (rate - taken) / (1.0 + slack)
    kd = w.droop_reach * (sag - droop * taken)
    kr = relieved - 2.0 * w.relieved_rate + slack * ks
    kt = (
        (wanted_stroke(ahead_pa, s.demand, unit) - stroke)
        - 2.0 * w.stroke_rate * unit.compensator_lag
    ) / (unit.compensator_lag + gh)
    s.oil += 0.5 * h * (3.0 * w.oil_rate + ks)
    s.droop += 0.5 * h * (3.0 * w.droop_rate + kd)
    s.pump_stroke += 0.5 * h * (3.0 * w.stroke_rate + kt)
    s.pressure, w.stiffness = supply_pressure(
        s.oil, s.pressure + h * w.stiffness * w.oil_rate, unit
    )
    was = w.enthalpy
    w.enthalpy = enthalpy(s.pressure, bulk, air)
    mean = 0.5 * (was + w.enthalpy) - w.tank_enthalpy
    flow = 0.5 * h * (w.pumped_rate + pumped)
    w.pumped += flow
    w.work_done += 0.5 * h * (w.pumped_rate * rise_1 + pumped * rise_2)
    given = 0.5 * h * (3.0 * w.relieved_rate + kr)
    w.relieved += given
    hauled = 0.5 * h * (w.traction_rate + pulled)
    w.pulled += hauled
    s.loss += given * mean
    s.traction_work += hauled * mean
    s.relief_flow = relieved
    return q


@njit_law
def end_supply(
    s: SupplyState,
    unit: PowerUnit,
    works: Records[SupplyWork],
    returned: float,
    heat_j: float,
    loss_before: float,
    dt: float,
) -> None:
    """Book a call's totals: tank, pump work, losses, temperature, time."""
    w = works[0]
    s.tank_oil += returned + w.relieved + w.pulled - w.pumped
    s.pump_work += w.work_done
    s.pump_power = w.work_done / dt
    s.throughput += w.pumped
    s.loss += heat_j
    lost = s.loss - loss_before
    s.temperature += (
        lost - dt * unit.cooling * (s.temperature - unit.ambient)
    ) / unit.heat_capacity
    s.time += dt
