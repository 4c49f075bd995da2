"""Turbulent flow through one valve edge, smoothed to laminar near zero pressure drop; the flow of a
port with its two edges.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from testbed.compiled import njit_law

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
