"""The machine's parameter file turned into the arrays of the hydraulic kernel, effect by effect."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError
from testbed.laws import columns as c
from testbed.laws import traction as tr
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.machine.model import Axis, Machine
from testbed.machine.names import AXES
from testbed.robot.linkage import RotationLinkage, stroke_m

Array = NDArray[np.float64]


def axis_parameters(machine: Machine, *, locked: bool = False) -> Array:
    """(12, AXIS_PARAMETERS): every cylinder with its valve, hose, seal, stops and transducers, as declared."""
    linkage = RotationLinkage.from_machine(machine)
    out = np.zeros((len(AXES), c.AXIS_PARAMETERS))
    for row, axis in zip(out, machine.axes.values(), strict=True):
        row[:] = _axis(axis, stroke_m(axis.cylinder, linkage))
        row[c.LOCKED] = float(locked)
    return out


def _axis(axis: Axis, stroke: float) -> Array:
    cyl, valve, seal, oil = axis.cylinder, axis.valve, axis.seal, axis.oil
    sensor, stop = axis.sensor, axis.end_stop
    bore, rod = cyl.bore_m, cyl.rod_m
    a = np.zeros(c.AXIS_PARAMETERS)
    a[c.AREA_A] = math.pi / 4 * bore**2
    a[c.AREA_B] = math.pi / 4 * (bore**2 - rod**2)
    a[c.STROKE] = stroke
    a[c.DEAD_A], a[c.DEAD_B] = cyl.dead_volume_a_m3, cyl.dead_volume_b_m3
    a[c.BULK], a[c.AIR] = oil.bulk_modulus_pa, oil.entrained_air
    a[c.LEAK_I], a[c.LEAK_O] = oil.internal_leakage_m3_s_pa, oil.outer_leakage_m3_s_pa
    a[c.HOSE_CAP], a[c.HOSE_CAP_B] = oil.hose_capacity_m3_pa, oil.hose_capacity_b_m3_pa
    a[c.HOSE_TIME] = oil.hose_time_s
    gain = axis.rated_flow_m3_s / math.sqrt(valve.rated_drop_per_edge_pa)
    for column, edge in (
        (c.K_PA, "edge_pa"),
        (c.K_AT, "edge_at"),
        (c.K_PB, "edge_pb"),
        (c.K_BT, "edge_bt"),
    ):
        a[column] = gain * getattr(valve, edge)
    a[c.DEADBAND], a[c.HYSTERESIS] = valve.deadband, valve.hysteresis
    a[c.SPOOL_WN] = 2 * math.pi * valve.natural_frequency_hz
    a[c.SPOOL_ZETA], a[c.AMP_TAU], a[c.EDGE_LEAK] = (
        valve.damping,
        valve.amplifier_lag_s,
        valve.edge_leakage_m3_s_pa,
    )
    a[c.EDGE_LEAK_P] = valve.edge_leakage_supply_m3_s_pa
    a[c.FC_POS], a[c.FS_POS] = cyl.coulomb_out_n, cyl.static_out_n
    a[c.CS_POS], a[c.VISC_POS] = cyl.stribeck_out_m_s, cyl.viscous_out_n_s_m
    a[c.FC_NEG], a[c.FS_NEG] = cyl.coulomb_in_n, cyl.static_in_n
    a[c.CS_NEG], a[c.VISC_NEG] = cyl.stribeck_in_m_s, cyl.viscous_in_n_s_m
    a[c.BRISTLE_K], a[c.BRISTLE_D] = seal.bristle_stiffness_n_m, seal.bristle_damping_n_s_m
    a[c.FR_POSITION], a[c.FR_PRESSURE] = seal.position_slope, seal.pressure_coefficient_m2
    a[c.FR_LOAD], a[c.FR_SIDE] = seal.load_coefficient, seal.side_load_coefficient
    a[c.DWELL_GAIN], a[c.DWELL_TIME] = seal.dwell_gain, seal.dwell_time_s
    a[c.CUSHION_LENGTH], a[c.CUSHION_D] = stop.cushion_length_m, stop.cushion_damping_n_s_m
    a[c.STOP_K], a[c.STOP_D] = stop.stiffness_n_m, stop.damping_n_s_m
    a[c.LINE_WN] = 2 * math.pi * sensor.line_b_frequency_hz
    a[c.LINE_ZETA] = sensor.line_b_damping
    a[c.TRANSDUCER_TAU] = 1.0 / (2 * math.pi * sensor.transducer_bandwidth_hz)
    return a


def unit_parameters(p: Machine, *, pump_on: bool = True) -> Array:
    """(SUPPLY_PARAMETERS): the power unit; gauge pressures of the file become absolute here.

    Raises InputError for parameters that cannot be.
    """
    unit, oil, seal = p.power_unit, p.oil, p.seal
    w = np.zeros(c.SUPPLY_PARAMETERS)
    w[c.PUMP_FLOW], w[c.PUMP_POWER], w[c.PUMP_ON] = (
        unit.full_flow_m3_s,
        unit.power_w,
        float(pump_on),
    )
    w[c.PUMP_SET] = unit.supply_pressure_pa + ATMOSPHERE_PA
    w[c.PUMP_BAND], w[c.PUMP_TAU] = unit.compensator_band_pa, unit.compensator_lag_s
    w[c.PUMP_LEAK] = unit.case_leakage_m3_s_pa
    w[c.RELIEF_SET], w[c.RELIEF_SLOPE] = (
        unit.relief_pressure_pa + ATMOSPHERE_PA,
        unit.relief_slope_m3_s_pa,
    )
    w[c.ACC_VOLUME] = unit.accumulator_volume_m3
    w[c.ACC_PRECHARGE] = unit.accumulator_precharge_pa + ATMOSPHERE_PA
    w[c.LINE_VOLUME], w[c.TANK_P] = unit.line_volume_m3, unit.tank_pressure_pa + ATMOSPHERE_PA
    w[c.SUPPLY_BULK], w[c.SUPPLY_AIR] = oil.bulk_modulus_pa, oil.entrained_air
    w[c.HEAT_CAPACITY], w[c.COOLING], w[c.AMBIENT] = (
        oil.heat_capacity_j_k,
        oil.cooling_w_k,
        oil.ambient_degc,
    )
    w[c.VISC_RATE], w[c.VISC_REFERENCE] = (
        seal.viscosity_rate_1_k,
        seal.viscosity_reference_degc,
    )
    w[c.DROOP_TIME] = 1.0
    return w


def traction_numbers(p: Machine, *, strokes: bool) -> Array:
    """(TRACTION_NUMBERS): a rope's traction device; without `strokes` a winch that hauls without end.

    Raises InputError for numbers that cannot be.
    """
    given, n = p.traction, np.zeros(tr.TRACTION_NUMBERS)
    for column, name in (
        (tr.AREA, "piston_area_m2"),
        (tr.RATING, "rating_n"),
        (tr.STROKE, "stroke_m"),
        (tr.SPEED, "speed_max_m_s"),
        (tr.CLAMP_S, "clamp_s"),
        (tr.RETURN_SPEED, "return_speed_m_s"),
        (tr.ANNULUS, "annulus_area_m2"),
    ):
        n[column] = getattr(given, name)
    least = 3.0 * tr.RESERVE_M
    if given.stroke_m <= least:
        raise InputError(
            "is impossible", field="traction.stroke_m", value=given.stroke_m, allowed=f"> {least:g}"
        )
    n[tr.SEAT] = given.seat_m
    if not strokes:
        n[tr.STROKE] = 0.0
    return n
