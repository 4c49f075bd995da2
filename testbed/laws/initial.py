"""Start states of the hydraulics: chambers that balance given rod forces, a charged supply."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.formats.arrays import Array
from testbed.laws.axis_records import AxisState
from testbed.laws.oil import ATMOSPHERE_PA, specific_volume
from testbed.laws.supply import LOAD_SENSING, SupplyState, supply_oil


def start_supply(unit: Any, temperature_degc: float, tank_oil_m3: float) -> Any:
    """A SupplyState for the PowerUnit `unit`: pump at its compensated (or standby) pressure,
    accumulator charged, tank filled.
    """
    supply = SupplyState.zeros()[0]
    ready = unit["standby"] if unit["kind"] == LOAD_SENSING else unit["set_pressure"]
    supply["demand"] = ready
    supply["pressure"] = ready if unit["pump_on"] else unit["tank_pressure"]
    supply["oil"] = supply_oil(supply["pressure"], unit)
    supply["tank_oil"] = tank_oil_m3
    supply["temperature"] = temperature_degc
    return supply


UNLOADED_PA = 1.0e6
"""Gauge pressure of the unloaded chamber at the start where no leak settles it lower (assumed)."""


def start_axes(
    params: NDArray[Any],
    x: Array,
    force_n: Array,
    unloaded_pa: float = UNLOADED_PA,
    supply: Any = None,
    tank_pa: float = ATMOSPHERE_PA,
    stuck: Array | float = 0.0,
) -> NDArray[Any]:
    """AxisState (n,) at rest: chamber pressures and friction give the rod `force_n` (n,) at
    extension `x` (n,).

    stuck (n,): friction as a share of break-away, -1 to 1, + as if the rod had stopped while going
    out. The unloaded chamber stands at `unloaded_pa` (gauge), the loaded one balances. With a
    SupplyState the machine has stood for a while: the unloaded chamber has settled to where its
    shut valve leaks it, if that is lower.
    """
    axes = AxisState.zeros(len(x))
    shares = np.broadcast_to(stuck, np.shape(x))
    for axis, param, extension, wanted, share in zip(axes, params, x, force_n, shares, strict=True):
        force = wanted + stick(axis["seal"], param["seal"], float(share))
        low_a = low_b = ATMOSPHERE_PA + unloaded_pa
        if supply is not None:
            low_a = min(low_a, settled_pa(param["a"], supply["pressure"], tank_pa, low_a))
            low_b = min(low_b, settled_pa(param["b"], supply["pressure"], tank_pa, low_b))
        area_a, area_b = param["a"]["area"], param["b"]["area"]
        rest = force + (area_a - area_b) * ATMOSPHERE_PA
        pressure_b = max(low_b, (low_a * area_a - rest) / area_b)
        axis["a"]["pressure"] = (rest + pressure_b * area_b) / area_a
        axis["b"]["pressure"] = pressure_b
        fill_chambers(axis, param, float(extension))
    return axes


def stick(seal: Any, p: Any, share: float) -> float:
    """Bend a SealState to this share of its break-away force, of the way it points to; returns the
    friction, N.
    """
    way = p["outward"] if share >= 0.0 else p["inward"]
    friction = share * (way["coulomb"] + way["static"])
    seal["bristle"] = friction / p["bristle_stiffness"]
    return float(friction)


def settled_pa(chamber: Any, supply_pa: float, tank_pa: float, tight_pa: float) -> float:
    """Pressure to which the shut edges of a ChamberParameters' valve leak it, Pa absolute;
    `tight_pa` if they do not.
    """
    from_supply, to_tank = chamber["leak_from_supply"], chamber["leak_to_tank"]
    if from_supply + to_tank <= 0.0:
        return tight_pa
    return float((from_supply * supply_pa + to_tank * tank_pa) / (from_supply + to_tank))


def fill_chambers(axis: Any, p: Any, x: float) -> None:
    """Make oil, hoses, pipe and transducers of one AxisState agree with its pressures at extension
    x, m.
    """
    axis["reached"] = x
    volumes = {
        "a": p["a"]["dead_volume"] + p["a"]["area"] * x,
        "b": p["b"]["dead_volume"] + p["b"]["area"] * (p["stroke"] - x),
    }
    for name, volume in volumes.items():
        chamber = axis[name]
        nu, _ = specific_volume(chamber["pressure"], p["oil"]["bulk_modulus"], p["oil"]["air"])
        widened = p[name]["hose_elasticity"] * (chamber["pressure"] - ATMOSPHERE_PA)
        chamber["oil"] = (volume + widened) / nu
        chamber["hose_pressure"] = chamber["pressure"]
        axis["transducers"][name] = chamber["pressure"]
    axis["transducers"]["pipe_pressure"] = axis["b"]["pressure"]
