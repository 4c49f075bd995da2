"""Start states of the hydraulic arrays: chambers that balance given rod forces, a charged supply."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.laws import columns as c
from testbed.laws.oil import ATMOSPHERE_PA, specific_volume
from testbed.laws.supply import supply_oil

Array = NDArray[np.float64]


def start_supply(unit: Array, temperature_degc: float, tank_oil_m3: float) -> Array:
    """(SUPPLY_STATES): pump at its compensated pressure, accumulator charged, tank filled."""
    s = np.zeros(c.SUPPLY_STATES)
    s[c.P_SUPPLY] = unit[c.PUMP_SET] if unit[c.PUMP_ON] else unit[c.TANK_P]
    s[c.OIL_SUPPLY] = supply_oil(s[c.P_SUPPLY], unit)
    s[c.OIL_TANK] = tank_oil_m3
    s[c.TEMPERATURE] = temperature_degc
    return s


def start_axes(params: Array, x: Array, force_n: Array, mean_pressure_pa: float = 3.0e6) -> Array:
    """(n, AXIS_STATES) at rest: chamber pressures give the rod `force_n` (n,) at extension `x` (n,), no friction.

    The unloaded chamber stands at about a third of `mean_pressure_pa`, the loaded one balances.
    """
    s = np.zeros((len(x), c.AXIS_STATES))
    for i, p in enumerate(params):
        low = ATMOSPHERE_PA + mean_pressure_pa / 3.0
        rest = force_n[i] + (p[c.AREA_A] - p[c.AREA_B]) * ATMOSPHERE_PA
        pb = max(low, (low * p[c.AREA_A] - rest) / p[c.AREA_B])
        pa = (rest + pb * p[c.AREA_B]) / p[c.AREA_A]
        s[i, c.P_A], s[i, c.P_B] = pa, pb
        fill_chambers(s[i], p, float(x[i]))
    return s


def fill_chambers(s: Any, p: Any, x: float) -> None:
    """Make the oil counts, hose, line and transducers of one axis agree with its pressures at extension x."""
    nu_a, _ = specific_volume(s[c.P_A], p[c.BULK], p[c.AIR])
    nu_b, _ = specific_volume(s[c.P_B], p[c.BULK], p[c.AIR])
    s[c.OIL_A] = (p[c.DEAD_A] + p[c.AREA_A] * x) / nu_a
    s[c.OIL_B] = (p[c.DEAD_B] + p[c.AREA_B] * (p[c.STROKE] - x)) / nu_b
    s[c.HOSE_P], s[c.HOSE_P_B] = s[c.P_A], s[c.P_B]
    s[c.LINE_P] = s[c.SENSED_B] = s[c.P_B]
    s[c.SENSED_A] = s[c.P_A]
