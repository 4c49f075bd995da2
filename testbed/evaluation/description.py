"""`recording.yaml` of a run of the whole robot: what each column is, and what the robot believes about itself."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from testbed.parameters.provenance import roboclimber
from testbed.parameters.scenario import Scenario

_UNITS: tuple[tuple[str, str, str], ...] = (
    ("t", "s", "time"),
    ("position_", "", "encoder: extension of the joint (rotation: angle)"),
    ("pressure_a_", "Pa", "piston side, gauge, through calibration"),
    ("pressure_b_", "Pa", "rod side, gauge, through calibration"),
    ("valve_", "1", "valve command, -1 to 1, + extends"),
    ("supply_pressure", "Pa", "supply pressure, gauge"),
    ("oil_temperature", "degC", "oil temperature"),
    ("rope_tension_", "N", "tension at the traction device"),
    ("attitude_", "rad", "inertial unit: roll, pitch, yaw of the body"),
    ("angular_rate_", "rad/s", "inertial unit: rate in the body frame"),
    ("specific_force_", "m/s2", "inertial unit at the body's origin: acceleration less gravity, body frame"),
    ("estimate_", "N", "foot load along the vertical joint's axis, by this method"),
    ("own_", "N", "force of the ground on the foot, body frame, by the own estimate; _sd: its standard deviation"),
    ("ordered_", "", "drill as control ordered it: thrust away from the ground, N; torque about body z, N m"),
    ("rods_mast_height", "m", "middle of the rods in the mast above the drill point, as the drill's controls have it"),
    ("rods_", "kg", "rods in the hole, in the mast, gained by the store since the start: the drill's own count"),
    ("expected_", "N", "foot load along the vertical joint's axis that the model expects"),
    ("contact_", "1", "the detector's word: 1 the foot carries, 0 it has lost contact"),
    ("carrying_", "1", "the control's wish: 1 the foot is meant to carry, 0 it swings"),
    ("drill_", "", "read at the drill's own controls"),
)


def recording_meta(scenario: Scenario, data_columns: list[str], surveyed: Mapping[str, Any]) -> dict[str, Any]:
    """The contents of `recording.yaml`; `surveyed`: what was measured before the run, such as where the ropes lead.

    Holds what the robot knows: no truth, no undeclared effect, no changed number of the world.
    """
    return {
        "format": "roboclimber-recording/1",
        "rig": "robot",
        "data": "data.parquet",
        "sample_rate_hz": scenario.rates.record_hz,
        "scenario": scenario.name,
        "description": scenario.description,
        "seed": scenario.seed,
        "task": scenario.task.kind,
        "channels": {c: _channel(c) for c in data_columns},
        "surveyed": dict(surveyed),
        "known": believed(scenario.model.parameters),
    }


def believed(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Every number of the machine as the robot believes it: dotted path -> value and unit."""
    machine = roboclimber().replaced(changes)
    return {
        path: {"value": list(q.value) if isinstance(q.value, tuple) else q.value, "unit": q.unit}
        for path, q in machine.leaves()
    }


def _channel(column: str) -> dict[str, Any]:
    for prefix, unit, meaning in _UNITS:
        if column == prefix or (prefix.endswith("_") and column.startswith(prefix)):
            if prefix == "position_":
                unit = "rad" if column.endswith("_rotation") else "m"
            return {"column": column, "unit": unit or "1", "meaning": meaning}
    return {"column": column, "unit": "1"}
