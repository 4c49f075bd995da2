"""Load-holding valves between a port of the valve and its chamber: oil enters freely, and leaves
under a condition.

A pilot-operated check valve (1) lets oil out where the spool opens the port to the tank; a
counterbalance valve (2) then opens with (p - pt) + pilot_ratio (pilot - pt) above its setting, over
COUNTERBALANCE_BAND_PA. Shut, both are tight. pilot: pressure of the other chamber.
"""

from __future__ import annotations

from testbed.compiled import njit_law
from testbed.laws.axis_records import ChamberParameters
from testbed.laws.orifice import PortFlow

NO_HOLDING, PILOT_CHECK, COUNTERBALANCE = 0.0, 1.0, 2.0
"""Kinds of load-holding valve."""
COUNTERBALANCE_BAND_PA = 1.0e6
"""Over this much above its setting a counterbalance valve opens fully (assumed)."""


@njit_law(forceinline=True)
def outlet_share(
    kind: float, load_pa: float, pilot_pa: float, setting_pa: float, pilot_ratio: float
) -> float:
    """0 to 1: how far the valve lets oil out while the spool opens its port to the tank.

    load_pa, pilot_pa: own and other chamber's pressure over the tank's.
    """
    if kind != COUNTERBALANCE:
        return 1.0
    over = load_pa + pilot_ratio * pilot_pa - setting_pa
    return min(max(over / COUNTERBALANCE_BAND_PA, 0.0), 1.0)


@njit_law(forceinline=True)
def held_port(
    flow: PortFlow, p: float, pilot: float, pt: float, chamber: ChamberParameters, to_tank: bool
) -> PortFlow:
    """What a load-holding valve lets through of a port's flow; no oil between it and
    the spool.

    Shut, it is tight: what the spool leaks past it, from supply to tank, is left out. pilot:
    pressure of the other chamber, Pa.
    """
    own = chamber.holding
    if own.kind == NO_HOLDING:
        return flow
    if not to_tank:
        return flow if flow.supply + flow.tank > 0.0 else PortFlow(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if own.kind == PILOT_CHECK:
        return flow
    share = outlet_share(own.kind, p - pt, pilot - pt, own.setting, own.pilot_ratio)
    steeper = -flow.tank / COUNTERBALANCE_BAND_PA if 0.0 < share < 1.0 else 0.0
    return PortFlow(
        share * flow.supply,
        share * flow.tank,
        share * flow.supply_slope,
        share * flow.tank_slope + steeper,
        share * flow.supply_growth,
        share * flow.tank_growth,
    )
