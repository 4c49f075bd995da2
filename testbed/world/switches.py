"""Hydraulic effects switched off by name: the quantities of the hydraulics' records that do it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from numpy.typing import NDArray

from testbed.errors import check_one_of
from testbed.formats.records import put
from testbed.laws.friction import SMALLEST_N
from testbed.laws.holding import NO_HOLDING
from testbed.laws.supply import CONSTANT
from testbed.scenario.parts import HYDRAULIC_PARTS

QUICK_RAD_S = 2.0 * math.pi * 1.0e5
"""A second-order part this quick answers within any step."""
QUICK_S = 1.0e-9
"""A lag this short is none."""

_COULOMB = {
    "seal.outward.coulomb": SMALLEST_N,
    "seal.inward.coulomb": SMALLEST_N,
    "seal.outward.static": 0.0,
    "seal.inward.static": 0.0,
    "seal.dwell_gain": 0.0,
    "seal.pressure_coefficient": 0.0,
    "seal.load_coefficient": 0.0,
    "seal.side_load_coefficient": 0.0,
    "seal.bristle_damping": 0.0,
}
_VISCOUS = {"seal.outward.viscous": 0.0, "seal.inward.viscous": 0.0}
_EDGE_LEAKAGE = {
    f"{chamber}.leak_{way}": 0.0 for chamber in "ab" for way in ("from_supply", "to_tank")
}

AXIS_OFF: dict[str, dict[str, float]] = {
    "friction": _COULOMB | _VISCOUS,
    "coulomb": _COULOMB,
    "stribeck": {"seal.outward.static": 0.0, "seal.inward.static": 0.0},
    "viscous": _VISCOUS,
    "dwell": {"seal.dwell_gain": 0.0},
    "friction_position": {"seal.position_slope": 0.0},
    "friction_pressure": {"seal.pressure_coefficient": 0.0},
    "friction_load": {"seal.load_coefficient": 0.0},
    "friction_side_load": {"seal.side_load_coefficient": 0.0},
    "leakage": {"inner_leakage": 0.0, "outer_leakage": 0.0, **_EDGE_LEAKAGE},
    "internal_leakage": {"inner_leakage": 0.0},
    "outer_leakage": {"outer_leakage": 0.0},
    "edge_leakage": _EDGE_LEAKAGE,
    "air": {"oil.air": 0.0},
    "hose": {"a.hose_capacity": 0.0, "b.hose_capacity": 0.0},
    "hose_elasticity": {"a.hose_elasticity": 0.0, "b.hose_elasticity": 0.0},
    "deadband": {"valve.dead_band": 0.0},
    "hysteresis": {"valve.hysteresis": 0.0},
    "valve_dynamics": {
        "valve.frequency": QUICK_RAD_S,
        "valve.damping": 1.0,
        "valve.amplifier_lag": QUICK_S,
    },
    "amplifier_lag": {"valve.amplifier_lag": QUICK_S},
    "edge_asymmetry": {},
    "load_holding": {"a.holding.kind": NO_HOLDING, "b.holding.kind": NO_HOLDING},
    "cushions": {"ends.cushion_damping": 0.0},
    "end_stops": {
        "ends.cushion_damping": 0.0,
        "ends.stop_stiffness": 0.0,
        "ends.stop_damping": 0.0,
    },
    "line_b": {"transducers.pipe_frequency": QUICK_RAD_S, "transducers.pipe_damping": 1.0},
    "transducer_lag": {"transducers.lag": QUICK_S},
}
"""Quantities of every axis's AxisParameters, by their dotted path."""

UNIT_OFF: dict[str, dict[str, float]] = {
    "air": {"oil.air": 0.0},
    "supply_droop": {"accumulator_volume": 100.0, "droop": 0.0},
    "accumulator": {"accumulator_volume": 0.0},
    "load_sensing": {"kind": CONSTANT},
    "pump_lag": {"compensator_lag": QUICK_S},
    "power_limit": {"pump_power": 1.0e12},
    "relief": {"relief_pressure": 1.0e12},
    "case_leakage": {"case_leakage": 0.0},
    "oil_warming": {"heat_capacity": 1.0e30},
    "viscosity": {"viscosity_rate": 0.0},
}
"""Quantities of the PowerUnit. `supply_droop` leaves the pressure where it stands, whoever
draws.
"""


def switch_off(names: Iterable[str], params: NDArray[Any], unit: Any) -> None:
    """Switch hydraulic effects off by name, in place: params (n) AxisParameters, unit a PowerUnit.

    Raises InputError for a name that is not one.
    """
    for name in names:
        check_one_of(name, HYDRAULIC_PARTS, "hydraulics.without", "no such hydraulic effect")
        for path, value in AXIS_OFF.get(name, {}).items():
            put(params, path, value)
        for path, value in UNIT_OFF.get(name, {}).items():
            put(unit, path, value)
        if name == "edge_asymmetry":
            params["b"]["from_supply"] = params["a"]["from_supply"]
            params["b"]["to_tank"] = params["a"]["to_tank"]
