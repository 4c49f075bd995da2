"""The machine's parameter file turned into the arrays of the hydraulic kernel, effect by effect."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError
from testbed.laws import columns as c
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.parameters.names import AXES, JOINTS
from testbed.parameters.provenance import Parameters

Array = NDArray[np.float64]

EFFECTS_OFF: dict[str, dict[int, float]] = {
    "internal_leakage": {c.LEAK_I: 0.0},
    "outer_leakage": {c.LEAK_O: 0.0},
    "edge_leakage": {c.EDGE_LEAK: 0.0},
    "entrained_air": {c.AIR: 0.0},
    "hose": {c.HOSE_CAP: 0.0},
    "deadband": {c.DEADBAND: 0.0},
    "hysteresis": {c.HYSTERESIS: 0.0},
    "amplifier_lag": {c.AMP_TAU: 1e-9},
    "coulomb": {c.FC_POS: 1.0, c.FC_NEG: 1.0, c.FS_POS: 0.0, c.FS_NEG: 0.0, c.DWELL_GAIN: 0.0},
    "stribeck": {c.FS_POS: 0.0, c.FS_NEG: 0.0},
    "viscous": {c.VISC_POS: 0.0, c.VISC_NEG: 0.0},
    "friction_position": {c.FR_POSITION: 0.0},
    "friction_pressure": {c.FR_PRESSURE: 0.0},
    "friction_side_load": {c.FR_SIDE: 0.0},
    "dwell": {c.DWELL_GAIN: 0.0},
    "cushions": {c.CUSHION_D: 0.0},
}
"""What a scenario may switch off by name (hydraulics.off), and the columns that do it on every axis."""

UNIT_OFF = {"oil_warming": {c.HEAT_CAPACITY: 1e30}, "viscosity": {c.VISC_RATE: 0.0}}


def strokes_m(p: Parameters, rotation_stroke_m: float) -> tuple[float, float, float]:
    """Stroke of the three cylinders of a leg, in the order rotation, radial, vertical."""
    return (
        rotation_stroke_m,
        float(p["radial_cylinder"]["stroke_m"]),
        float(p["vertical_cylinder"]["stroke_m"]),
    )


def axis_parameters(p: Parameters, rotation_stroke_m: float, *, locked: bool = False) -> Array:
    """(12, AXIS_PARAMETERS): every cylinder with its valve, hose, seal, stops and transducers, as declared.

    Raises InputError for parameters that cannot be (rod thicker than bore, dead band >= 1, negative volume).
    """
    out = np.zeros((len(AXES), c.AXIS_PARAMETERS))
    for i in range(len(AXES)):
        joint = JOINTS[i % 3]
        out[i] = _axis(p, joint, strokes_m(p, rotation_stroke_m)[i % 3])
        out[i, c.LOCKED] = float(locked)
    return out


def _axis(p: Parameters, joint: str, stroke_m: float) -> Array:
    cyl, group = p[f"{joint}_cylinder"], f"{joint}_cylinder"
    seal, oil, valve, sensor, stop = p["seal"], p["oil"], p["valve"], p["sensor"], p["end_stop"]
    bore, rod = cyl["bore_m"], cyl["rod_m"]
    _require(0.0 < bore <= 1.0, f"{group}.bore_m", bore, "0 < bore <= 1 m")
    _require(0.0 < rod < bore, f"{group}.rod_m", rod, f"0 < rod < bore = {bore} m")
    _require(stroke_m > 0.0, f"{group}.stroke_m", stroke_m, "> 0")
    for name in ("dead_volume_a_m3", "dead_volume_b_m3"):
        _require(cyl[name] > 0.0, f"{group}.{name}", cyl[name], "> 0")
    _require(0.0 <= valve["deadband"] < 1.0, "valve.deadband", valve["deadband"], "0 <= dead band < 1")
    _require(0.0 <= oil["entrained_air"] < 0.5, "oil.entrained_air", oil["entrained_air"], "0 <= air < 0.5")
    _require(oil["bulk_modulus_pa"] >= 1e7, "oil.bulk_modulus_pa", oil["bulk_modulus_pa"], ">= 1e7 Pa")
    a = np.zeros(c.AXIS_PARAMETERS)
    a[c.AREA_A] = math.pi / 4 * bore**2
    a[c.AREA_B] = math.pi / 4 * (bore**2 - rod**2)
    a[c.STROKE] = stroke_m
    a[c.DEAD_A], a[c.DEAD_B] = cyl["dead_volume_a_m3"], cyl["dead_volume_b_m3"]
    a[c.BULK], a[c.AIR] = oil["bulk_modulus_pa"], oil["entrained_air"]
    a[c.LEAK_I], a[c.LEAK_O] = oil["internal_leakage_m3_s_pa"], oil["outer_leakage_m3_s_pa"]
    a[c.HOSE_CAP], a[c.HOSE_TIME] = oil["hose_capacity_m3_pa"], oil["hose_time_s"]
    gain = valve[f"rated_flow_{joint}_m3_s"] / math.sqrt(valve["rated_drop_per_edge_pa"])
    for column, edge in ((c.K_PA, "edge_pa"), (c.K_AT, "edge_at"), (c.K_PB, "edge_pb"), (c.K_BT, "edge_bt")):
        _require(valve[edge] >= 0.0, f"valve.{edge}", valve[edge], ">= 0")
        a[column] = gain * valve[edge]
    a[c.DEADBAND], a[c.HYSTERESIS] = valve["deadband"], valve["hysteresis"]
    a[c.SPOOL_WN] = 2 * math.pi * valve["natural_frequency_hz"]
    a[c.SPOOL_ZETA], a[c.AMP_TAU], a[c.EDGE_LEAK] = (
        valve["damping"], valve["amplifier_lag_s"], valve["edge_leakage_m3_s_pa"],
    )  # fmt: skip
    a[c.FC_POS], a[c.FS_POS] = cyl["coulomb_out_n"], cyl["static_out_n"]
    a[c.CS_POS], a[c.VISC_POS] = cyl["stribeck_out_m_s"], cyl["viscous_out_n_s_m"]
    a[c.FC_NEG], a[c.FS_NEG] = cyl["coulomb_in_n"], cyl["static_in_n"]
    a[c.CS_NEG], a[c.VISC_NEG] = cyl["stribeck_in_m_s"], cyl["viscous_in_n_s_m"]
    a[c.BRISTLE_K], a[c.BRISTLE_D] = seal["bristle_stiffness_n_m"], seal["bristle_damping_n_s_m"]
    a[c.FR_POSITION], a[c.FR_PRESSURE] = seal["position_slope"], seal["pressure_coefficient_m2"]
    a[c.FR_LOAD], a[c.FR_SIDE] = seal["load_coefficient"], seal["side_load_coefficient"]
    a[c.DWELL_GAIN], a[c.DWELL_TIME] = seal["dwell_gain"], seal["dwell_time_s"]
    a[c.CUSHION_LENGTH], a[c.CUSHION_D] = stop["cushion_length_m"], stop["cushion_damping_n_s_m"]
    a[c.STOP_K], a[c.STOP_D] = stop["stiffness_n_m"], stop["damping_n_s_m"]
    a[c.LINE_WN] = 2 * math.pi * sensor["line_b_frequency_hz"]
    a[c.LINE_ZETA] = sensor["line_b_damping"]
    a[c.TRANSDUCER_TAU] = 1.0 / (2 * math.pi * sensor["transducer_bandwidth_hz"])
    return a


def unit_parameters(p: Parameters, *, pump_on: bool = True) -> Array:
    """(SUPPLY_PARAMETERS): the power unit; gauge pressures of the file become absolute here."""
    unit, oil, seal = p["power_unit"], p["oil"], p["seal"]
    w = np.zeros(c.SUPPLY_PARAMETERS)
    _require(unit["supply_pressure_pa"] > unit["tank_pressure_pa"], "power_unit.supply_pressure_pa",
             unit["supply_pressure_pa"], "above the tank's pressure")  # fmt: skip
    w[c.PUMP_FLOW], w[c.PUMP_POWER], w[c.PUMP_ON] = unit["full_flow_m3_s"], unit["power_w"], float(pump_on)
    w[c.PUMP_SET] = unit["supply_pressure_pa"] + ATMOSPHERE_PA
    w[c.PUMP_BAND], w[c.PUMP_TAU] = unit["compensator_band_pa"], unit["compensator_lag_s"]
    w[c.PUMP_LEAK] = unit["case_leakage_m3_s_pa"]
    w[c.RELIEF_SET], w[c.RELIEF_SLOPE] = (
        unit["relief_pressure_pa"] + ATMOSPHERE_PA,
        unit["relief_slope_m3_s_pa"],
    )
    w[c.ACC_VOLUME] = unit["accumulator_volume_m3"]
    w[c.ACC_PRECHARGE] = unit["accumulator_precharge_pa"] + ATMOSPHERE_PA
    w[c.LINE_VOLUME], w[c.TANK_P] = unit["line_volume_m3"], unit["tank_pressure_pa"] + ATMOSPHERE_PA
    w[c.SUPPLY_BULK], w[c.SUPPLY_AIR] = oil["bulk_modulus_pa"], oil["entrained_air"]
    w[c.HEAT_CAPACITY], w[c.COOLING], w[c.AMBIENT] = (
        oil["heat_capacity_j_k"],
        oil["cooling_w_k"],
        oil["ambient_degc"],
    )
    w[c.VISC_RATE], w[c.VISC_REFERENCE] = seal["viscosity_rate_1_k"], seal["viscosity_reference_degc"]
    w[c.DROOP_TIME] = 1.0
    return w


def switch_off(names: Iterable[str], params: Array, unit: Array) -> None:
    """Switch hydraulic effects off by name, in place. Raises InputError for a name that is not one."""
    for name in names:
        if name not in EFFECTS_OFF and name not in UNIT_OFF:
            raise InputError("no such hydraulic effect", field="hydraulics.off", value=name,
                             allowed=", ".join([*EFFECTS_OFF, *UNIT_OFF]))  # fmt: skip
        for column, value in EFFECTS_OFF.get(name, {}).items():
            params[:, column] = value
        for column, value in UNIT_OFF.get(name, {}).items():
            unit[column] = value


def _require(condition: bool, field: str, value: object, allowed: str) -> None:
    if not condition:
        raise InputError("is impossible", file="roboclimber.yaml", field=field, value=value, allowed=allowed)
