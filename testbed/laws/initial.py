"""Start states of the hydraulics: chambers that balance given rod forces, a charged supply."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.laws.hydraulics import AxisState
from testbed.laws.oil import ATMOSPHERE_PA, specific_volume
from testbed.laws.supply import LOAD_SENSING, SupplyState, supply_oil

Array = NDArray[np.float64]


def start_supply(unit: Any, temperature_degc: float, tank_oil_m3: float) -> Any:
    """A SupplyState for the PowerUnit `unit`: pump at its compensated (or standby) pressure, accumulator charged, tank filled."""
    supply = SupplyState.zeros()[0]
    ready = unit["standby"] if unit["kind"] == LOAD_SENSING else unit["set_pressure"]
    supply["demand"] = ready
    supply["pressure"] = ready if unit["pump_on"] else unit["tank_pressure"]
    supply["oil"] = supply_oil(supply["pressure"], unit)
    supply["tank_oil"] = tank_oil_m3
    supply["temperature"] = temperature_degc
    return supply


def start_axes(
    params: NDArray[Any], x: Array, force_n: Array, mean_pressure_pa: float = 3.0e6
) -> NDArray[Any]:
    """AxisState (n,) at rest: chamber pressures give the rod `force_n` (n,) at extension `x` (n,), no friction.

    The unloaded chamber stands at about a third of `mean_pressure_pa`, the loaded one balances.
    """
    axes = AxisState.zeros(len(x))
    low = ATMOSPHERE_PA + mean_pressure_pa / 3.0
    for axis, p, extension, force in zip(axes, params, x, force_n, strict=True):
        area_a, area_b = p["a"]["area"], p["b"]["area"]
        rest = force + (area_a - area_b) * ATMOSPHERE_PA
        pressure_b = max(low, (low * area_a - rest) / area_b)
        axis["a"]["pressure"] = (rest + pressure_b * area_b) / area_a
        axis["b"]["pressure"] = pressure_b
        fill_chambers(axis, p, float(extension))
    return axes


def fill_chambers(axis: Any, p: Any, x: float) -> None:
    """Make oil, hoses, pipe and transducers of one AxisState agree with its pressures at extension x, m."""
    axis["reached"] = x
    volumes = {
        "a": p["a"]["dead_volume"] + p["a"]["area"] * x,
        "b": p["b"]["dead_volume"] + p["b"]["area"] * (p["stroke"] - x),
    }
    for name, volume in volumes.items():
        chamber = axis[name]
        nu, _ = specific_volume(chamber["pressure"], p["oil"]["bulk_modulus"], p["oil"]["air"])
        chamber["oil"] = volume / nu
        chamber["hose_pressure"] = chamber["pressure"]
        axis["transducers"][name] = chamber["pressure"]
    axis["transducers"]["pipe_pressure"] = axis["b"]["pressure"]
