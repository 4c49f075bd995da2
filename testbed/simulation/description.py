"""`recording.yaml` of a run of the whole robot: what each column is, and what the robot believes
about itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from testbed.machine.model import Machine
from testbed.machine.names import AXES
from testbed.recording.robot_columns import described
from testbed.scenario.scenario import Scenario


def recording_meta(
    scenario: Scenario, belief: Machine, data_columns: list[str], surveyed: Mapping[str, Any]
) -> dict[str, Any]:
    """The contents of `recording.yaml`; `surveyed`: what was measured before the run, such as where
    the ropes lead.

    Holds what the robot knows: no truth, no undeclared effect, no changed number of the world.
    """
    ranges = transducer_ranges_pa(belief)
    return {
        "format": "roboclimber-recording/1",
        "rig": "robot",
        "data": "data.parquet",
        "sample_rate_hz": scenario.rates.record_hz,
        "scenario": scenario.name,
        "description": scenario.description,
        "seed": scenario.seed,
        "task": scenario.task.kind,
        "channels": {column: _channel(column, ranges) for column in data_columns},
        "surveyed": dict(surveyed),
        "known": known(belief),
    }


def known(machine: Machine) -> dict[str, Any]:
    """Every number of the machine as the robot believes it: dotted path -> value and unit."""
    return {
        path: {
            "value": list(quantity.value) if isinstance(quantity.value, tuple) else quantity.value,
            "unit": quantity.unit,
        }
        for path, quantity in machine.leaves()
    }


def transducer_ranges_pa(machine: Machine) -> dict[str, list[float]]:
    """Lowest and highest reading of every pressure channel, Pa gauge, as its data sheet has it."""
    return {
        f"pressure_{chamber}_{axis}": [0.0, machine.axes[axis].sensor.pressure_range_pa]
        for axis in AXES
        for chamber in "ab"
    }


def _channel(column: str, ranges_pa: Mapping[str, list[float]]) -> dict[str, Any]:
    found = described(column)
    unit, *meaning = ("1",) if found is None else found
    out: dict[str, Any] = {"column": column, "unit": unit}
    if column in ranges_pa:
        out["range_pa"] = ranges_pa[column]
    return out | ({"meaning": meaning[0]} if meaning else {})
