"""Power unit: pressure-compensated pump with flow and power limit, relief valve, accumulator, tank, warming oil.

Oil in line and accumulator, standard volume: W = (line volume + accumulator(p)) / nu(p), and

    W' = pump - drawn by the axes - traction - relief - leakage (+ make-up from the tank below its pressure)
    stroke' = (wanted(p) - stroke) / PUMP_TAU, wanted = 1 at PUMP_SET - PUMP_BAND, 0 at PUMP_SET
    pump = min(stroke * full flow, power / enthalpy rise)
    droop' = (-droop - DROOP * drawn) / DROOP_TIME, what the valves see is p + droop
"""

from __future__ import annotations

import math
from typing import Any

from testbed.laws import columns as c
from testbed.laws.chamber import GAMMA
from testbed.laws.compiling import njit_law
from testbed.laws.oil import VAPOUR_PA, enthalpy, specific_volume

TRACTION_BAND_PA = 1.0e5
"""Over this much above the tank the traction devices fade in: nothing is drawn from an empty line."""

# --- working numbers of the unit within one call --------------------------------------------------------------
(
    PUMPED_1,
    RELIEF_1,
    TRACTION_1,
    KS_1,
    KD_1,
    KR_1,
    KT_1,
    STIFF,
    RELIEF_GAIN,
    REACH,
    D_REACH,
    ENTHALPY,
    ENTHALPY_TANK,
    PUMPED,
    WORK_DONE,
    RELIEVED,
    DRAWN,
    PULLED,
    PEAK_POWER,
    UNIT_WORK,
) = range(20)


@njit_law
def accumulator(p_pa: float, volume_m3: float, precharge_pa: float) -> tuple[float, float]:
    """Oil in a bladder accumulator (m3, isothermal gas: V0 (1 - p0 / p)) and its derivative by p; 0 below precharge."""
    if p_pa <= precharge_pa:
        return 0.0, 0.0
    ratio = precharge_pa / p_pa
    return volume_m3 * (1.0 - ratio), volume_m3 * ratio / p_pa


@njit_law
def supply_oil_slope(p_pa: float, unit: Any) -> tuple[float, float]:
    """Standard volume of oil in line and accumulator at the absolute pressure p, m3, and its slope by p."""
    nu, dnu = specific_volume(p_pa, unit[c.SUPPLY_BULK], unit[c.SUPPLY_AIR])
    acc, dacc = accumulator(p_pa, unit[c.ACC_VOLUME], unit[c.ACC_PRECHARGE])
    oil = (unit[c.LINE_VOLUME] + acc) / nu
    return oil, (dacc - oil * dnu) / nu


@njit_law
def supply_oil(p_pa: float, unit: Any) -> float:
    """Standard volume of oil in line and accumulator at the absolute pressure p, m3; unit: SUPPLY_PARAMETERS."""
    oil, _ = supply_oil_slope(p_pa, unit)
    return float(oil)


@njit_law
def supply_pressure(oil: float, guess_pa: float, unit: Any) -> tuple[float, float]:
    """Absolute pressure (Pa) of the line that holds `oil`, and its slope by oil (Pa/m3); vapour pressure if empty."""
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
        # The precharge is a kink: Newton's step may jump to and fro across it, so halve what encloses the root.
        limit = 0.5 * (low + high) if high < math.inf else 2.0 * p + 1.0e6
        p = new if low < new < (high if high < math.inf else limit) else limit
    return p, 1.0 / slope


@njit_law
def pump(stroke: float, rise_j_m3: float, unit: Any) -> float:
    """Flow of the pump, standard m3/s: its stroke's, or what the power allows at this rise of enthalpy."""
    flow = stroke * unit[c.PUMP_FLOW] * unit[c.PUMP_ON]
    if flow * rise_j_m3 > unit[c.PUMP_POWER]:
        return float(unit[c.PUMP_POWER] / rise_j_m3)
    return float(flow)


@njit_law
def wanted_stroke(p_pa: float, unit: Any) -> float:
    """What the compensator asks for, 0..1."""
    wanted = (unit[c.PUMP_SET] - p_pa) / unit[c.PUMP_BAND]
    return float(0.0 if wanted < 0.0 else (1.0 if wanted > 1.0 else wanted))


@njit_law
def relief(p_pa: float, unit: Any) -> tuple[float, float]:
    """Flow to the tank through relief valve and case leakage (negative: made up from the tank), m3/s, and its slope."""
    flow, slope = unit[c.PUMP_LEAK] * (p_pa - unit[c.TANK_P]), unit[c.PUMP_LEAK]
    over = p_pa - unit[c.RELIEF_SET]
    under = p_pa - unit[c.TANK_P]
    if over > 0.0:
        flow, slope = flow + unit[c.RELIEF_SLOPE] * over, slope + unit[c.RELIEF_SLOPE]
    elif under < 0.0:  # the suction check valve opens
        flow, slope = flow + unit[c.RELIEF_SLOPE] * under, slope + unit[c.RELIEF_SLOPE]
    return flow, slope


@njit_law
def traction(p_pa: float, s: Any, unit: Any) -> float:
    """What the traction devices take, m3/s."""
    above = (p_pa - unit[c.TANK_P]) / TRACTION_BAND_PA
    return float(s[c.TRACTION_FLOW] * (0.0 if above < 0.0 else (1.0 if above > 1.0 else above)))


@njit_law
def begin_supply(s: Any, unit: Any, w: Any) -> None:
    """Clear a call's totals; slope and enthalpy at its start."""
    for k in range(PUMPED, UNIT_WORK):
        w[k] = 0.0
    w[ENTHALPY_TANK] = enthalpy(unit[c.TANK_P], unit[c.SUPPLY_BULK], unit[c.SUPPLY_AIR])
    s[c.P_SUPPLY], w[STIFF] = supply_pressure(s[c.OIL_SUPPLY], s[c.P_SUPPLY], unit)
    w[ENTHALPY] = enthalpy(s[c.P_SUPPLY], unit[c.SUPPLY_BULK], unit[c.SUPPLY_AIR])


@njit_law
def supply_first(
    s: Any, unit: Any, w: Any, drawn: float, rise: float, h: float
) -> tuple[float, float]:
    """First stage of the unit: the rate q of the valves' supply pressure (Pa/s) and that pressure at the end (Pa).

    `drawn` and `rise`: the axes draw drawn + rise q (chamber.first_stage).
    """
    gh = GAMMA * h
    p = s[c.P_SUPPLY]
    w[PUMPED_1] = pump(s[c.PUMP_STROKE], w[ENTHALPY] - w[ENTHALPY_TANK], unit)
    w[RELIEF_1], w[RELIEF_GAIN] = relief(p, unit)
    w[TRACTION_1] = traction(p, s, unit)
    rate = w[PUMPED_1] - w[RELIEF_1] - w[TRACTION_1]
    stiff = w[STIFF]
    # An accumulator that empties within this substep leaves a line a hundred times stiffer: take that slope.
    _, ahead = supply_pressure(
        s[c.OIL_SUPPLY] + h * (rate - drawn), p + h * stiff * (rate - drawn), unit
    )
    w[STIFF] = stiff = ahead if ahead > stiff else stiff
    w[REACH] = stiff / (1.0 + gh * w[RELIEF_GAIN] * stiff)
    w[D_REACH] = 1.0 / (1.0 + gh / unit[c.DROOP_TIME])
    droop = unit[c.DROOP] / unit[c.DROOP_TIME]
    sag = -s[c.DROOP_P] / unit[c.DROOP_TIME]
    q = (w[REACH] * (rate - drawn) + w[D_REACH] * (sag - droop * drawn)) / (
        1.0 + (w[REACH] + w[D_REACH] * droop) * rise
    )
    taken = drawn + rise * q
    w[KS_1] = (rate - taken) / (1.0 + gh * w[RELIEF_GAIN] * stiff)
    w[KD_1] = w[D_REACH] * (sag - droop * taken)
    w[KR_1] = w[RELIEF_1] + gh * w[RELIEF_GAIN] * stiff * w[KS_1]
    w[KT_1] = (wanted_stroke(p, unit) - s[c.PUMP_STROKE]) / (unit[c.PUMP_TAU] + gh)
    w[DRAWN] = taken
    ahead_pa, _ = supply_pressure(s[c.OIL_SUPPLY] + h * w[KS_1], p + h * stiff * w[KS_1], unit)
    return q, ahead_pa


@njit_law
def supply_second(
    s: Any, unit: Any, w: Any, ahead_pa: float, drawn: float, rise: float, h: float
) -> float:
    """Second stage: returns the second q; oil, pressure, stroke, droop and totals advance."""
    gh = GAMMA * h
    bulk, air = unit[c.SUPPLY_BULK], unit[c.SUPPLY_AIR]
    rise_1 = w[ENTHALPY] - w[ENTHALPY_TANK]
    rise_2 = enthalpy(ahead_pa, bulk, air) - w[ENTHALPY_TANK]
    stroke = s[c.PUMP_STROKE] + h * w[KT_1]
    pumped = pump(stroke, rise_2, unit)
    relieved, _ = relief(ahead_pa, unit)
    pulled = traction(ahead_pa, s, unit)
    droop = unit[c.DROOP] / unit[c.DROOP_TIME]
    sag = -(s[c.DROOP_P] + h * w[KD_1]) / unit[c.DROOP_TIME] - 2.0 * (w[KD_1] + droop * w[DRAWN])
    rate = pumped - relieved - pulled - 2.0 * (w[KS_1] + w[DRAWN])
    q = (w[REACH] * (rate - drawn) + w[D_REACH] * (sag - droop * drawn)) / (
        1.0 + (w[REACH] + w[D_REACH] * droop) * rise
    )
    taken = drawn + rise * q
    slack = gh * w[RELIEF_GAIN] * w[STIFF]
    ks = (rate - taken) / (1.0 + slack)
    kd = w[D_REACH] * (sag - droop * taken)
    kr = relieved - 2.0 * w[KR_1] + slack * ks
    kt = ((wanted_stroke(ahead_pa, unit) - stroke) - 2.0 * w[KT_1] * unit[c.PUMP_TAU]) / (
        unit[c.PUMP_TAU] + gh
    )
    s[c.OIL_SUPPLY] += 0.5 * h * (3.0 * w[KS_1] + ks)
    s[c.DROOP_P] += 0.5 * h * (3.0 * w[KD_1] + kd)
    s[c.PUMP_STROKE] += 0.5 * h * (3.0 * w[KT_1] + kt)
    s[c.P_SUPPLY], w[STIFF] = supply_pressure(
        s[c.OIL_SUPPLY], s[c.P_SUPPLY] + h * w[STIFF] * w[KS_1], unit
    )
    was = w[ENTHALPY]
    w[ENTHALPY] = enthalpy(s[c.P_SUPPLY], bulk, air)
    mean = 0.5 * (was + w[ENTHALPY]) - w[ENTHALPY_TANK]
    flow = 0.5 * h * (w[PUMPED_1] + pumped)
    w[PUMPED] += flow
    w[WORK_DONE] += 0.5 * h * (w[PUMPED_1] * rise_1 + pumped * rise_2)
    given = 0.5 * h * (3.0 * w[KR_1] + kr)
    w[RELIEVED] += given
    hauled = 0.5 * h * (w[TRACTION_1] + pulled)
    w[PULLED] += hauled
    s[c.LOSS] += given * mean
    s[c.TRACTION_WORK] += hauled * mean
    s[c.RELIEF_FLOW] = relieved
    return float(q)


@njit_law
def end_supply(
    s: Any, unit: Any, w: Any, returned: float, heat_j: float, loss_before: float, dt: float
) -> None:
    """Book a call's totals: tank, pump work, losses, temperature, time."""
    s[c.OIL_TANK] += returned + w[RELIEVED] + w[PULLED] - w[PUMPED]
    s[c.PUMP_WORK] += w[WORK_DONE]
    s[c.PUMP_POWER_NOW] = w[WORK_DONE] / dt
    s[c.THROUGHPUT] += w[PUMPED]
    s[c.LOSS] += heat_j
    lost = s[c.LOSS] - loss_before
    s[c.TEMPERATURE] += (lost - dt * unit[c.COOLING] * (s[c.TEMPERATURE] - unit[c.AMBIENT])) / unit[
        c.HEAT_CAPACITY
    ]
    s[c.TIME] += dt
