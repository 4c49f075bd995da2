"""Turbulent flow through one valve edge, smoothed to laminar near zero pressure drop; the flow of a
port with its two edges.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from testbed.compiled import njit_law
from testbed.laws.axis_records import ChamberParameters, ChamberWork

LAMINAR_DROP_PA = 2.0e4
"""Pressure drop below which the flow turns laminar (assumed; a sharp edge at Re of some tens)."""


@njit_law(forceinline=True)
def orifice(drop_pa: float) -> tuple[float, float]:
    """Smoothed `sign(dp) sqrt(|dp|)` and its derivative by dp, in sqrt(Pa) and 1/sqrt(Pa).

    f(dp) = dp / (dp^2 + d^2)^(1/4) with d = LAMINAR_DROP_PA: exact to 1 % for |dp| > 5 d, linear
    through zero. The flow is `coefficient * opening * f(dp)`, the coefficient being rated flow /
    sqrt(rated drop).
    """
    square = drop_pa * drop_pa
    inverse = 1.0 / (square + LAMINAR_DROP_PA * LAMINAR_DROP_PA)
    inverse_root = math.sqrt(math.sqrt(inverse))
    return drop_pa * inverse_root, inverse_root * (1.0 - 0.5 * square * inverse)


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
def port(
    p: float,
    ps: float,
    pt: float,
    chamber: ChamberParameters,
    w: ChamberWork,
    o: float,
    o_next: float,
) -> PortFlow:
    """One port at pressure p between supply ps and tank pt, Pa, while its opening goes from o to
    `o_next`.

    o > 0 opens the port to the supply, o < 0 to the tank; the open edge is turbulent, both edges
    leak laminarly.
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
