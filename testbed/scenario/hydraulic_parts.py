"""The parts of the hydraulics that a scenario may leave out (`hydraulics.without`), by name."""

from __future__ import annotations

from typing import Literal, get_args

HydraulicPart = Literal[
    "friction",
    "coulomb",
    "stribeck",
    "viscous",
    "dwell",
    "friction_position",
    "friction_pressure",
    "friction_load",
    "friction_side_load",
    "leakage",
    "internal_leakage",
    "outer_leakage",
    "edge_leakage",
    "air",
    "hose",
    "hose_elasticity",
    "deadband",
    "hysteresis",
    "valve_dynamics",
    "amplifier_lag",
    "edge_asymmetry",
    "load_holding",
    "cushions",
    "end_stops",
    "line_b",
    "transducer_lag",
    "load_sensing",
    "supply_droop",
    "accumulator",
    "pump_lag",
    "power_limit",
    "relief",
    "case_leakage",
    "oil_warming",
    "viscosity",
]
HYDRAULIC_PARTS: tuple[str, ...] = get_args(HydraulicPart)
"""The one list: the scenario checks against it, the world has a switch for each
(testbed.world.switches).
"""
