"""Numbers of parts that a scenario leaves out (`hydraulics.without`, `sensors.without`): beside
that they would change nothing.
"""

from __future__ import annotations

NUMBERS = r"hydraulics\.parameters\."
_AXIS = r"(axes\.\w+\.)?"
_CYLINDER = r"(axes\.\w+\.|\w+_)cylinder\."
_SEAL, _OIL, _VALVE = (rf"{_AXIS}{group}\." for group in ("seal", "oil", "valve"))
_STOP, SENSOR = (rf"{_AXIS}{group}\." for group in ("end_stop", "sensor"))
_UNIT = r"power_unit\."

_STATIC = rf"{_CYLINDER}(static|stribeck)_\w+"
_DWELL = rf"{_SEAL}dwell_(gain|time_s)"
_BY_PRESSURE = rf"{_SEAL}pressure_coefficient_m2"
_BY_LOAD = rf"{_SEAL}load_coefficient"
_BY_SIDE_LOAD = rf"{_SEAL}side_load_(coefficient|growth)"
_BRISTLE = rf"{_SEAL}(bristle_\w+|elastic_share|position_slope)"
_DRY = (
    rf"{_CYLINDER}coulomb_\w+|{_STATIC}|{_DWELL}|{_BY_PRESSURE}|{_BY_LOAD}|{_BY_SIDE_LOAD}"
    rf"|{_BRISTLE}"
)
_VISCOUS = rf"{_CYLINDER}viscous_\w+"
_INNER, _OUTER = rf"{_OIL}internal_leakage_m3_s_pa", rf"{_OIL}outer_leakage_m3_s_pa"
_EDGES = rf"{_VALVE}edge_\w+_leakage_m3_s_pa"
_LAG = rf"{_VALVE}amplifier_lag_s"
_CUSHION = rf"{_STOP}cushion_\w+"

OF_HYDRAULICS = {
    "friction": f"{_DRY}|{_VISCOUS}",
    "coulomb": _DRY,
    "stribeck": _STATIC,
    "viscous": _VISCOUS,
    "dwell": _DWELL,
    "friction_position": rf"{_SEAL}position_slope",
    "friction_pressure": _BY_PRESSURE,
    "friction_load": _BY_LOAD,
    "friction_side_load": _BY_SIDE_LOAD,
    "leakage": f"{_INNER}|{_OUTER}|{_EDGES}",
    "internal_leakage": _INNER,
    "outer_leakage": _OUTER,
    "edge_leakage": _EDGES,
    "air": rf"{_OIL}entrained_air",
    "hose": rf"{_OIL}hose_(capacity\w*|time_s)",
    "hose_elasticity": rf"{_OIL}hose_elasticity_\w+",
    "deadband": rf"{_VALVE}deadband",
    "hysteresis": rf"{_VALVE}hysteresis",
    "valve_dynamics": rf"{_VALVE}(natural_frequency_hz|damping)|{_LAG}",
    "amplifier_lag": _LAG,
    "edge_asymmetry": rf"{_VALVE}edge_(pb|bt)",
    "load_holding": rf"{_VALVE}(holding_[ab]|counterbalance_\w+)",
    "cushions": _CUSHION,
    "end_stops": rf"{_STOP}\w+",
    "line_b": rf"{SENSOR}line_b_(frequency_hz|damping)",
    "load_sensing": rf"{_UNIT}(supply_kind|load_sensing_\w+|standby_pressure_pa|unloading_band_pa)",
    "supply_droop": rf"{_UNIT}accumulator_volume_m3",
    "accumulator": rf"{_UNIT}accumulator_\w+",
    "pump_lag": rf"{_UNIT}compensator_lag_s",
    "power_limit": rf"{_UNIT}power_w",
    "relief": rf"{_UNIT}relief_pressure_pa",
    "case_leakage": rf"{_UNIT}case_leakage_m3_s_pa",
    "oil_warming": r"oil\.(heat_capacity_j_k|cooling_w_k|ambient_degc)",
    "viscosity": rf"{_SEAL}viscosity_(rate_1_k|reference_degc)",
}
"""Part -> pattern of its numbers, as `hydraulics.parameters` names them. The transducers' lag has
none: what it lets pass of a ripple remains.
"""
OF_SENSORS = {
    "pressure": rf"{SENSOR}(pressure_(noise|resolution|ripple|linearity|hysteresis)|thermal)_\w+",
    "encoder": rf"{SENSOR}encoder_\w+",
    "inertial": rf"{SENSOR}(attitude|rate|specific_force)_(noise|bias)_\w+",
    "rope_tension": rf"{SENSOR}rope_tension_noise_n",
    "supply_pressure": rf"{SENSOR}supply_noise_pa",
    "oil_temperature": rf"{SENSOR}temperature_resolution_k",
}
"""The same of the sensors' errors."""
STUCK = ("friction", "coulomb")
"""Parts without which no seal is stuck at the start (`hydraulics.stuck_seals`)."""
