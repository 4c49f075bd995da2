"""Power unit: pressure-compensated pump with flow and power limit, relief valve, accumulator, tank, warming oil."""

from __future__ import annotations

from typing import Any

from numba import njit

from testbed.laws import columns as c
from testbed.laws.oil import specific_volume


@njit(cache=True)
def accumulator(p_pa: float, volume_m3: float, precharge_pa: float) -> tuple[float, float]:
    """Oil in a bladder accumulator (m3, isothermal gas: V0 (1 - p0 / p)) and its derivative by p; 0 below precharge."""
    if p_pa <= precharge_pa:
        return 0.0, 0.0
    ratio = precharge_pa / p_pa
    return volume_m3 * (1.0 - ratio), volume_m3 * ratio / p_pa


@njit(cache=True)
def supply_oil(p_pa: float, w: Any) -> float:
    """Standard volume of oil in line and accumulator at the absolute pressure p; w = power unit parameters."""
    nu, _ = specific_volume(p_pa, w[c.SUPPLY_BULK], w[c.SUPPLY_AIR])
    acc, _ = accumulator(p_pa, w[c.ACC_VOLUME], w[c.ACC_PRECHARGE])
    return float((w[c.LINE_VOLUME] + acc) / nu)


@njit(cache=True)
def supply_step(s: Any, w: Any, drawn: float, drawn_slope: float, returned: float, heat_w: float, dt: float) -> None:
    """Advance the power unit by dt: s its state, w its parameters (columns.py), changed in place.

    `drawn` m3/s leaves towards valves and traction (its slope by supply pressure makes the step implicit),
    `returned` m3/s comes back to the tank, `heat_w` is what throttles, leakage and friction turned into heat.
    The pump delivers min(stroke * full flow, power / pressure); its stroke follows the compensator
    (full flow at `PUMP_SET - PUMP_BAND`, none at `PUMP_SET`) with the lag PUMP_TAU.
    """
    p = s[c.P_SUPPLY]
    wanted = (w[c.PUMP_SET] - p) / w[c.PUMP_BAND]
    wanted = 0.0 if wanted < 0.0 else (1.0 if wanted > 1.0 else wanted)
    s[c.PUMP_STROKE] += dt / (w[c.PUMP_TAU] + dt) * (wanted - s[c.PUMP_STROKE])
    rise = p - w[c.TANK_P]
    flow = s[c.PUMP_STROKE] * w[c.PUMP_FLOW] * w[c.PUMP_ON]
    if flow * rise > w[c.PUMP_POWER]:
        flow = w[c.PUMP_POWER] / rise
    relief = (p - w[c.RELIEF_SET]) * w[c.RELIEF_SLOPE]
    relief_slope = w[c.RELIEF_SLOPE] if relief > 0.0 else 0.0
    relief = relief if relief > 0.0 else 0.0
    leak = w[c.PUMP_LEAK] * rise
    out = drawn + relief + leak
    nu, slope = specific_volume(p, w[c.SUPPLY_BULK], w[c.SUPPLY_AIR])
    acc, acc_slope = accumulator(p, w[c.ACC_VOLUME], w[c.ACC_PRECHARGE])
    volume = w[c.LINE_VOLUME] + acc
    g = volume / nu - s[c.OIL_SUPPLY] - dt * (flow - out)
    out_slope = drawn_slope + relief_slope + w[c.PUMP_LEAK]
    dp = -g / (acc_slope / nu - volume * slope / (nu * nu) + dt * out_slope)
    if p + dp < w[c.TANK_P]:
        dp = w[c.TANK_P] - p
    s[c.P_SUPPLY] = p + dp
    # The oil that valves drew at this step's pressure has moved already: only relief and leak follow dp.
    out += (relief_slope + w[c.PUMP_LEAK]) * dp
    s[c.OIL_SUPPLY] += dt * (flow - out)
    s[c.OIL_TANK] += dt * (returned + relief + leak + (relief_slope + w[c.PUMP_LEAK]) * dp - flow)
    s[c.RELIEF_FLOW] = relief
    s[c.PUMP_WORK] += dt * flow * rise
    s[c.THROUGHPUT] += dt * flow
    heat = heat_w + (relief + leak) * rise
    s[c.LOSS] += dt * heat
    s[c.TEMPERATURE] += dt * (heat - w[c.COOLING] * (s[c.TEMPERATURE] - w[c.AMBIENT])) / w[c.HEAT_CAPACITY]
    s[c.TIME] += dt
