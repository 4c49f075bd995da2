"""Hydraulic effects switched off by name: the columns of the kernel's arrays that do it."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError
from testbed.laws import columns as c
from testbed.laws.friction import SMALLEST_N
from testbed.scenario.hydraulic_parts import HYDRAULIC_PARTS

Array = NDArray[np.float64]

QUICK_RAD_S = 2.0 * math.pi * 1.0e5
"""A second-order part this quick answers within any step."""
QUICK_S = 1.0e-9

_COULOMB = {
    c.FC_POS: SMALLEST_N,
    c.FC_NEG: SMALLEST_N,
    c.FS_POS: 0.0,
    c.FS_NEG: 0.0,
    c.DWELL_GAIN: 0.0,
    c.FR_PRESSURE: 0.0,
    c.FR_LOAD: 0.0,
    c.FR_SIDE: 0.0,
    c.BRISTLE_D: 0.0,
}
_VISCOUS = {c.VISC_POS: 0.0, c.VISC_NEG: 0.0}

AXIS_OFF: dict[str, dict[int, float]] = {
    "friction": _COULOMB | _VISCOUS,
    "coulomb": _COULOMB,
    "stribeck": {c.FS_POS: 0.0, c.FS_NEG: 0.0},
    "viscous": _VISCOUS,
    "dwell": {c.DWELL_GAIN: 0.0},
    "friction_position": {c.FR_POSITION: 0.0},
    "friction_pressure": {c.FR_PRESSURE: 0.0},
    "friction_load": {c.FR_LOAD: 0.0},
    "friction_side_load": {c.FR_SIDE: 0.0},
    "leakage": {c.LEAK_I: 0.0, c.LEAK_O: 0.0, c.EDGE_LEAK: 0.0, c.EDGE_LEAK_P: 0.0},
    "internal_leakage": {c.LEAK_I: 0.0},
    "outer_leakage": {c.LEAK_O: 0.0},
    "edge_leakage": {c.EDGE_LEAK: 0.0, c.EDGE_LEAK_P: 0.0},
    "air": {c.AIR: 0.0},
    "hose": {c.HOSE_CAP: 0.0, c.HOSE_CAP_B: 0.0},
    "deadband": {c.DEADBAND: 0.0},
    "hysteresis": {c.HYSTERESIS: 0.0},
    "valve_dynamics": {c.SPOOL_WN: QUICK_RAD_S, c.SPOOL_ZETA: 1.0, c.AMP_TAU: QUICK_S},
    "amplifier_lag": {c.AMP_TAU: QUICK_S},
    "edge_asymmetry": {},
    "cushions": {c.CUSHION_D: 0.0},
    "end_stops": {c.CUSHION_D: 0.0, c.STOP_K: 0.0, c.STOP_D: 0.0},
    "line_b": {c.LINE_WN: QUICK_RAD_S, c.LINE_ZETA: 1.0},
    "transducer_lag": {c.TRANSDUCER_TAU: QUICK_S},
}
"""Columns of every axis."""

UNIT_OFF: dict[str, dict[int, float]] = {
    "air": {c.SUPPLY_AIR: 0.0},
    "supply_droop": {c.ACC_VOLUME: 100.0, c.DROOP: 0.0},
    "accumulator": {c.ACC_VOLUME: 0.0},
    "pump_lag": {c.PUMP_TAU: QUICK_S},
    "power_limit": {c.PUMP_POWER: 1.0e12},
    "relief": {c.RELIEF_SET: 1.0e12},
    "case_leakage": {c.PUMP_LEAK: 0.0},
    "oil_warming": {c.HEAT_CAPACITY: 1.0e30},
    "viscosity": {c.VISC_RATE: 0.0},
}
"""Columns of the power unit. `supply_droop` leaves the pressure where it stands, whoever draws."""


def switch_off(names: Iterable[str], params: Array, unit: Array) -> None:
    """Switch hydraulic effects off by name, in place: params (n, AXIS_PARAMETERS), unit (SUPPLY_PARAMETERS).

    Raises InputError for a name that is not one.
    """
    for name in names:
        if name not in HYDRAULIC_PARTS:
            raise InputError(
                "no such hydraulic effect",
                field="hydraulics.without",
                value=name,
                allowed=", ".join(HYDRAULIC_PARTS),
            )
        for column, value in AXIS_OFF.get(name, {}).items():
            params[:, column] = value
        for column, value in UNIT_OFF.get(name, {}).items():
            unit[column] = value
        if name == "edge_asymmetry":
            params[:, c.K_PB], params[:, c.K_BT] = params[:, c.K_PA], params[:, c.K_AT]
