"""The machine's parameter file turned into the records of the hydraulics, effect by effect."""

from __future__ import annotations

import math
from typing import Any

from numpy.typing import NDArray

from testbed.laws.hydraulics import AxisParameters
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.laws.supply import PowerUnit
from testbed.laws.traction import RESERVE_M, TractionParameters
from testbed.machine.limits import check_cylinders, check_power_unit, require
from testbed.machine.names import AXES, JOINTS
from testbed.machine.provenance import Parameters

Records = NDArray[Any]


def strokes_m(p: Parameters, rotation_stroke_m: float) -> tuple[float, float, float]:
    """Stroke of the three cylinders of a leg, in the order rotation, radial, vertical."""
    return (
        rotation_stroke_m,
        float(p["radial_cylinder"]["stroke_m"]),
        float(p["vertical_cylinder"]["stroke_m"]),
    )


def axis_parameters(p: Parameters, rotation_stroke_m: float, *, locked: bool = False) -> Records:
    """AxisParameters (12,): every cylinder with its valve, hoses, seal, stops and transducers, as declared.

    Raises InputError for parameters that cannot be (rod thicker than bore, dead band >= 1, negative volume).
    """
    check_cylinders(p)
    require(
        0.0 < rotation_stroke_m <= 10.0,
        "rotation_cylinder.stroke_m",
        rotation_stroke_m,
        "0 < stroke <= 10 m",
    )
    axes = AxisParameters.zeros(len(AXES))
    for i, axis in enumerate(axes):
        joint = JOINTS[i % 3]
        axis["stroke"] = strokes_m(p, rotation_stroke_m)[i % 3]
        _cylinder(axis, p, joint)
        _valve(axis, p["valve"], joint)
        _seal(axis["seal"], p["seal"], p[f"{joint}_cylinder"])
        _ends(axis["ends"], p["end_stop"])
        _transducers(axis["transducers"], p["sensor"])
        axis["valve"]["locked"] = float(locked)
    return axes


def _cylinder(axis: Any, p: Parameters, joint: str) -> None:
    cylinder, oil = p[f"{joint}_cylinder"], p["oil"]
    bore, rod = cylinder["bore_m"], cylinder["rod_m"]
    axis["a"]["area"] = math.pi / 4 * bore**2
    axis["b"]["area"] = math.pi / 4 * (bore**2 - rod**2)
    axis["a"]["dead_volume"] = cylinder["dead_volume_a_m3"]
    axis["b"]["dead_volume"] = cylinder["dead_volume_b_m3"]
    axis["a"]["hose_capacity"] = oil["hose_capacity_m3_pa"]
    axis["b"]["hose_capacity"] = oil["hose_capacity_b_m3_pa"]
    axis["hose_time"] = oil["hose_time_s"]
    axis["oil"]["bulk_modulus"], axis["oil"]["air"] = oil["bulk_modulus_pa"], oil["entrained_air"]
    axis["inner_leakage"] = oil["internal_leakage_m3_s_pa"]
    axis["outer_leakage"] = oil["outer_leakage_m3_s_pa"]


def _valve(axis: Any, valve: Parameters, joint: str) -> None:
    gain = valve[f"rated_flow_{joint}_m3_s"] / math.sqrt(valve["rated_drop_per_edge_pa"])
    axis["a"]["from_supply"] = gain * valve["edge_pa"]
    axis["a"]["to_tank"] = gain * valve["edge_at"]
    axis["b"]["from_supply"] = gain * valve["edge_pb"]
    axis["b"]["to_tank"] = gain * valve["edge_bt"]
    own = axis["valve"]
    own["deadband"], own["hysteresis"] = valve["deadband"], valve["hysteresis"]
    own["frequency"] = 2 * math.pi * valve["natural_frequency_hz"]
    own["damping"], own["amplifier_lag"] = valve["damping"], valve["amplifier_lag_s"]
    own["leak_to_tank"] = valve["edge_leakage_m3_s_pa"]
    own["leak_from_supply"] = valve["edge_leakage_supply_m3_s_pa"]


def _seal(own: Any, seal: Parameters, cylinder: Parameters) -> None:
    for direction, ending in (("outward", "out"), ("inward", "in")):
        way = own[direction]
        way["coulomb"] = cylinder[f"coulomb_{ending}_n"]
        way["static"] = cylinder[f"static_{ending}_n"]
        way["stribeck_speed"] = cylinder[f"stribeck_{ending}_m_s"]
        way["viscous"] = cylinder[f"viscous_{ending}_n_s_m"]
    own["bristle_stiffness"] = seal["bristle_stiffness_n_m"]
    own["bristle_damping"] = seal["bristle_damping_n_s_m"]
    own["position_slope"] = seal["position_slope"]
    own["pressure_coefficient"] = seal["pressure_coefficient_m2"]
    own["load_coefficient"] = seal["load_coefficient"]
    own["side_load_coefficient"] = seal["side_load_coefficient"]
    own["dwell_gain"], own["dwell_time"] = seal["dwell_gain"], seal["dwell_time_s"]


def _ends(own: Any, stop: Parameters) -> None:
    own["cushion_length"] = stop["cushion_length_m"]
    own["cushion_damping"] = stop["cushion_damping_n_s_m"]
    own["stop_stiffness"] = stop["stiffness_n_m"]
    own["stop_damping"] = stop["damping_n_s_m"]


def _transducers(own: Any, sensor: Parameters) -> None:
    own["pipe_frequency"] = 2 * math.pi * sensor["line_b_frequency_hz"]
    own["pipe_damping"] = sensor["line_b_damping"]
    own["lag"] = 1.0 / (2 * math.pi * sensor["transducer_bandwidth_hz"])


def unit_parameters(p: Parameters, *, pump_on: bool = True) -> Any:
    """The PowerUnit; gauge pressures of the file become absolute here.

    Raises InputError for parameters that cannot be.
    """
    check_power_unit(p)
    given, oil, seal = p["power_unit"], p["oil"], p["seal"]
    unit = PowerUnit.zeros()[0]
    unit["pump_on"] = float(pump_on)
    unit["pump_flow"], unit["pump_power"] = given["full_flow_m3_s"], given["power_w"]
    unit["set_pressure"] = given["supply_pressure_pa"] + ATMOSPHERE_PA
    unit["compensator_band"] = given["compensator_band_pa"]
    unit["compensator_lag"] = given["compensator_lag_s"]
    unit["case_leakage"] = given["case_leakage_m3_s_pa"]
    unit["relief_pressure"] = given["relief_pressure_pa"] + ATMOSPHERE_PA
    unit["relief_slope"] = given["relief_slope_m3_s_pa"]
    unit["accumulator_volume"] = given["accumulator_volume_m3"]
    unit["accumulator_precharge"] = given["accumulator_precharge_pa"] + ATMOSPHERE_PA
    unit["line_volume"] = given["line_volume_m3"]
    unit["tank_pressure"] = given["tank_pressure_pa"] + ATMOSPHERE_PA
    unit["oil"]["bulk_modulus"], unit["oil"]["air"] = oil["bulk_modulus_pa"], oil["entrained_air"]
    unit["heat_capacity"], unit["cooling"] = oil["heat_capacity_j_k"], oil["cooling_w_k"]
    unit["ambient"] = oil["ambient_degc"]
    unit["viscosity_rate"] = seal["viscosity_rate_1_k"]
    unit["viscosity_reference"] = seal["viscosity_reference_degc"]
    unit["droop_time"] = 1.0
    return unit


TRACTION_NAMES = {
    "area": "piston_area_m2",
    "annulus": "annulus_area_m2",
    "rating": "rating_n",
    "stroke": "stroke_m",
    "speed": "speed_max_m_s",
    "return_speed": "return_speed_m_s",
    "clamp_time": "clamp_s",
}
"""Quantity of TractionParameters -> parameter of the machine."""


def traction_parameters(p: Parameters, *, strokes: bool) -> Any:
    """TractionParameters of a rope's device; without `strokes` a winch that hauls without end.

    Raises InputError for numbers that cannot be.
    """
    given, device = p["traction"], TractionParameters.zeros()[0]
    for quantity, name in TRACTION_NAMES.items():
        require(given[name] > 0.0, f"traction.{name}", given[name], "> 0")
        device[quantity] = given[name]
    least = 3.0 * RESERVE_M
    require(given["stroke_m"] > least, "traction.stroke_m", given["stroke_m"], f"> {least:g}")
    require(given["seat_m"] >= 0.0, "traction.seat_m", given["seat_m"], ">= 0")
    device["seat"] = given["seat_m"]
    if not strokes:
        device["stroke"] = 0.0
    return device
