"""Flow through one port of the valve, and through the load-holding valve behind it."""

from __future__ import annotations

from typing import Any, NamedTuple

from testbed.laws.compiling import njit_law
from testbed.laws.holding import COUNTERBALANCE_BAND_PA, NO_HOLDING, PILOT_CHECK, outlet_share
from testbed.laws.orifice import orifice


class PortFlow(NamedTuple):
    """Flow into a port (m3/s), its slopes by the pressure drops (m3/(s Pa)), and its growth with
    the opening (m3/s).
    """

    supply: float
    tank: float
    supply_slope: float
    tank_slope: float
    supply_growth: float
    tank_growth: float


@njit_law(forceinline=True)
def port(p: float, ps: float, pt: float, chamber: Any, w: Any, o: float, o_next: float) -> PortFlow:
    """One port at pressure p between supply ps and tank pt, Pa, while its opening goes from o to
    `o_next`.

    chamber: ChamberParameters; w: ChamberWork. o > 0 opens the port to the supply, o < 0 to the
    tank; the open edge is turbulent, both edges leak laminarly.
    """
    leak_p, leak = w.leak_from_supply, w.leak_to_tank
    if o + o_next > 0.0:
        f, df = orifice(ps - p)
        now = chamber.from_supply * (o if o > 0.0 else 0.0)
        then = chamber.from_supply * (o_next if o_next > 0.0 else 0.0)
        return PortFlow(
            now * f + leak_p * (ps - p),
            leak * (pt - p),
            now * df + leak_p,
            leak,
            (then - now) * f,
            0.0,
        )
    if o + o_next < 0.0:
        f, df = orifice(pt - p)
        now = chamber.to_tank * (-o if o < 0.0 else 0.0)
        then = chamber.to_tank * (-o_next if o_next < 0.0 else 0.0)
        return PortFlow(
            leak_p * (ps - p),
            now * f + leak * (pt - p),
            leak_p,
            now * df + leak,
            0.0,
            (then - now) * f,
        )
    return PortFlow(leak_p * (ps - p), leak * (pt - p), leak_p, leak, 0.0, 0.0)


@njit_law(forceinline=True)
def held_port(
    flow: PortFlow, p: float, pilot: float, pt: float, chamber: Any, to_tank: bool
) -> PortFlow:
    """What a load-holding valve (holding.py) lets through of a port's flow; no oil between it and
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
