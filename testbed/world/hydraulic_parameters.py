"""The machine's parameter file turned into the records of the hydraulics, effect by effect."""

from __future__ import annotations

import math
from typing import Any

from numpy.typing import NDArray

from testbed.laws.axis_records import AxisParameters
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.laws.supply import PowerUnit
from testbed.machine.groups import Oil
from testbed.machine.model import Axis, Machine
from testbed.machine.names import AXES
from testbed.robot.linkage import Linkages

Records = NDArray[Any]


def axis_parameters(
    machine: Machine, *, locked: bool = False, oil_degc: float | None = None
) -> Records:
    """AxisParameters (12,): every cylinder with its valve, hoses, seal, stops and transducers, as
    declared; `oil_degc`: how warm its oil starts, if otherwise.
    """
    degc = machine.oil.start_temperature_degc if oil_degc is None else oil_degc
    axes = AxisParameters.zeros(len(AXES))
    axes["stroke"] = Linkages.from_machine(machine).stroke_m
    for out, axis in zip(axes, machine.axes.values(), strict=True):
        _cylinder(out, axis, degc)
        _valve(out, axis)
        _seal(out["seal"], axis)
        _ends(out["ends"], axis)
        _transducers(out["transducers"], axis)
        out["valve"]["locked"] = float(locked)
    return axes


def _cylinder(out: Any, axis: Axis, degc: float) -> None:
    cylinder, oil = axis.cylinder, axis.oil
    out["a"]["area"], out["b"]["area"] = cylinder.areas_m2
    out["a"]["dead_volume"] = cylinder.dead_volume_a_m3
    out["b"]["dead_volume"] = cylinder.dead_volume_b_m3
    out["a"]["hose_elasticity"] = oil.hose_elasticity_m3_pa
    out["b"]["hose_elasticity"] = oil.hose_elasticity_b_m3_pa
    out["a"]["hose_capacity"] = oil.hose_capacity_m3_pa
    out["b"]["hose_capacity"] = oil.hose_capacity_b_m3_pa
    out["hose_time"] = oil.hose_time_s
    out["oil"]["bulk_modulus"], out["oil"]["air"] = bulk_modulus_pa(oil, degc), oil.entrained_air
    out["inner_leakage"] = oil.internal_leakage_m3_s_pa
    out["outer_leakage"] = oil.outer_leakage_m3_s_pa


def bulk_modulus_pa(oil: Oil, degc: float) -> float:
    """Of an oil that starts this warm; a run keeps it, as its oil warms by a few K."""
    beyond = degc - oil.declared_at_degc
    return oil.bulk_modulus_pa * math.exp(-oil.bulk_modulus_rate_1_k * beyond)


def _valve(out: Any, axis: Axis) -> None:
    valve, own = axis.valve, out["valve"]
    gain = axis.rated_flow_m3_s / math.sqrt(valve.rated_drop_per_edge_pa)
    out["a"]["from_supply"], out["a"]["to_tank"] = gain * valve.edge_pa, gain * valve.edge_at
    out["b"]["from_supply"], out["b"]["to_tank"] = gain * valve.edge_pb, gain * valve.edge_bt
    own["dead_band"], own["hysteresis"] = valve.deadband, valve.hysteresis
    own["frequency"] = 2 * math.pi * valve.natural_frequency_hz
    own["damping"], own["amplifier_lag"] = valve.damping, valve.amplifier_lag_s
    out["a"]["leak_from_supply"] = valve.edge_pa_leakage_m3_s_pa
    out["a"]["leak_to_tank"] = valve.edge_at_leakage_m3_s_pa
    out["b"]["leak_from_supply"] = valve.edge_pb_leakage_m3_s_pa
    out["b"]["leak_to_tank"] = valve.edge_bt_leakage_m3_s_pa
    for chamber, kind in (("a", valve.holding_a), ("b", valve.holding_b)):
        holding = out[chamber]["holding"]
        holding["kind"] = kind
        holding["setting"] = valve.counterbalance_setting_pa
        holding["pilot_ratio"] = valve.counterbalance_pilot_ratio


def _seal(own: Any, axis: Axis) -> None:
    cylinder, seal = axis.cylinder, axis.seal
    out, back = own["outward"], own["inward"]
    out["coulomb"], out["static"] = cylinder.coulomb_out_n, cylinder.static_out_n
    out["stribeck_speed"] = cylinder.stribeck_out_m_s
    out["viscous"] = cylinder.viscous_out_n_s_m
    back["coulomb"], back["static"] = cylinder.coulomb_in_n, cylinder.static_in_n
    back["stribeck_speed"] = cylinder.stribeck_in_m_s
    back["viscous"] = cylinder.viscous_in_n_s_m
    own["bristle_stiffness"] = seal.bristle_stiffness_n_m
    own["bristle_damping"] = seal.bristle_damping_n_s_m
    own["elastic_share"] = seal.elastic_share
    own["position_slope"] = seal.position_slope
    own["pressure_coefficient"] = seal.pressure_coefficient_m2
    own["load_coefficient"] = seal.load_coefficient
    own["side_load_coefficient"] = seal.side_load_coefficient
    own["side_load_growth"] = seal.side_load_growth
    own["dwell_gain"], own["dwell_time"] = seal.dwell_gain, seal.dwell_time_s


def _ends(own: Any, axis: Axis) -> None:
    stop = axis.end_stop
    own["cushion_length"] = stop.cushion_length_m
    own["cushion_damping"] = stop.cushion_damping_n_s_m
    own["stop_stiffness"], own["stop_damping"] = stop.stiffness_n_m, stop.damping_n_s_m


def _transducers(own: Any, axis: Axis) -> None:
    sensor = axis.sensor
    own["pipe_frequency"] = 2 * math.pi * sensor.line_b_frequency_hz
    own["pipe_damping"] = sensor.line_b_damping
    own["lag"] = 1.0 / (2 * math.pi * sensor.transducer_bandwidth_hz)


def unit_parameters(
    machine: Machine, *, pump_on: bool = True, oil_degc: float | None = None
) -> Any:
    """The PowerUnit; gauge pressures of the file become absolute here; `oil_degc`: how warm the oil
    starts, if otherwise than declared.
    """
    degc = machine.oil.start_temperature_degc if oil_degc is None else oil_degc
    given, oil, seal = machine.power_unit, machine.oil, machine.seal
    unit = PowerUnit.zeros()[0]
    unit["pump_on"] = float(pump_on)
    unit["pump_flow"], unit["pump_power"] = given.full_flow_m3_s, given.power_w
    unit["kind"] = given.supply_kind
    unit["set_pressure"] = given.supply_pressure_pa + ATMOSPHERE_PA
    unit["margin"] = given.load_sensing_margin_pa
    unit["standby"] = given.standby_pressure_pa + ATMOSPHERE_PA
    unit["sensing_lag"] = given.load_sensing_lag_s
    unit["unloading_band"] = given.unloading_band_pa
    unit["compensator_band"] = given.compensator_band_pa
    unit["compensator_lag"] = given.compensator_lag_s
    unit["case_leakage"] = given.case_leakage_m3_s_pa
    unit["relief_pressure"] = given.relief_pressure_pa + ATMOSPHERE_PA
    unit["relief_slope"] = given.relief_slope_m3_s_pa
    unit["accumulator_volume"] = given.accumulator_volume_m3
    unit["accumulator_precharge"] = given.accumulator_precharge_pa + ATMOSPHERE_PA
    unit["line_volume"] = given.line_volume_m3
    unit["tank_pressure"] = given.tank_pressure_pa + ATMOSPHERE_PA
    unit["oil"]["bulk_modulus"], unit["oil"]["air"] = bulk_modulus_pa(oil, degc), oil.entrained_air
    unit["heat_capacity"], unit["cooling"] = oil.heat_capacity_j_k, oil.cooling_w_k
    unit["ambient"] = oil.ambient_degc
    unit["viscosity_rate"] = seal.viscosity_rate_1_k
    unit["declared_at"] = oil.declared_at_degc
    unit["viscosity_reference"] = seal.viscosity_reference_degc
    unit["droop_time"] = 1.0
    return unit
