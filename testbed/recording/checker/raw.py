"""A recording as it is, faults and all: columns in SI where the readers would refuse the whole."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from testbed.formats.arrays import Array, Flags
from testbed.formats.table import read_columns
from testbed.formats.units import span_to_si, to_si
from testbed.formats.yaml_files import read_mapping
from testbed.machine.model import Machine
from testbed.recording.axis import recording_folder
from testbed.recording.axis_header import RECORDING, AnyHeader, Header, check_format, read_header
from testbed.recording.checks import in_pa
from testbed.recording.foot import read_foot_header
from testbed.recording.robot import machine_of, read_robot_header
from testbed.recording.robot_columns import is_evidence

REFERENCE = "reference_force"
"""Name under which a load cell's column stands among the channels."""


@dataclass(frozen=True, eq=False)
class Raw:
    """Columns (n,) in SI by quantity, pressures through their calibration; nothing is left out or
    put right.
    """

    name: str
    rig: str
    header: AnyHeader
    time_s: Array
    series: Mapping[str, Array]
    resolutions: Mapping[str, float]
    ranges_pa: Mapping[str, tuple[float, float]]
    machine: Machine | None = None
    """The robot's numbers as it believes them; None for one axis or one foot."""

    def kept(self, rows: Flags, filled: Mapping[str, Array]) -> Raw:
        """Only these rows, with `filled` columns in place of those of the same name."""
        series = {key: value[rows] for key, value in {**self.series, **filled}.items()}
        return replace(self, time_s=self.time_s[rows], series=series)


def read_raw(place: str | Path) -> Raw:
    """Read a recording of any rig without looking at its values.

    Raises InputError for a header that cannot be understood, or a table that lacks a declared
    column.
    """
    folder = recording_folder(place)
    file = folder / "recording.yaml"
    tree = read_mapping(file, RECORDING)
    check_format(tree, file)
    header: AnyHeader
    machine = None
    if tree.get("rig") == "foot":
        header = read_foot_header(file)
    elif tree.get("rig") == "robot":
        header = read_robot_header(file)
        machine = machine_of(header, file)
    else:
        header = read_header(file)
    time = "t" if machine is not None else "time"
    channels = {
        name: channel
        for name, channel in header.channels.items()
        if machine is None or is_evidence(name)
    }
    wanted = {channel.column: f"channels.{name}.column" for name, channel in channels.items()}
    reference = header.reference_force if isinstance(header, Header) else None
    if reference is not None and reference.column is not None:
        wanted[reference.column] = f"{REFERENCE}.column"
    columns = read_columns(folder / header.data, wanted, file)
    series = {
        name: in_pa(channel, to_si(columns[channel.column], channel.unit))
        for name, channel in channels.items()
    }
    finest = {
        name: span_to_si(channel.resolution, channel.unit)
        for name, channel in channels.items()
        if channel.resolution is not None and channel.calibration is None
    }
    if reference is not None and reference.column is not None:
        series[REFERENCE] = to_si(columns[reference.column], reference.unit or "N")
        if reference.resolution:
            finest[REFERENCE] = span_to_si(reference.resolution, reference.unit or "N")
    ranges = {
        name: channel.range_pa for name, channel in channels.items() if channel.range_pa is not None
    }
    return Raw(
        folder.resolve().name,
        str(tree["rig"]),
        header,
        series.pop(time),
        series,
        finest,
        ranges,
        machine,
    )


def repetitions(values: Array) -> tuple[Array, Array]:
    """(first rows, lengths) of the runs in which `values` (n,) repeats itself to the last bit."""
    first = np.concatenate([[0], np.flatnonzero(np.diff(values) != 0.0) + 1])
    return first, np.diff(np.concatenate([first, [len(values)]]))
