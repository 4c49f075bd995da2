"""Load-holding valves between a port of the valve and its chamber: oil enters freely, and leaves
under a condition.

A pilot-operated check valve (1) lets oil out where the spool opens the port to the tank; a
counterbalance valve (2) then opens with (p - pt) + pilot_ratio (pilot - pt) above its setting, over
COUNTERBALANCE_BAND_PA. Shut, both are
tight. pilot: pressure of the other chamber.
"""

from __future__ import annotations

from testbed.laws.compiling import njit_law

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
