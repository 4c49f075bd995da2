"""A recording of one foot whose force is known already: what contact detectors read.

The machine behind it may weigh two kilograms or four tonnes: its scale comes with the recording.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from testbed.errors import InputError
from testbed.formats.arrays import Array, Flags
from testbed.formats.checked import Checked, checked
from testbed.formats.table import read_columns
from testbed.formats.units import to_si
from testbed.formats.yaml_files import read_mapping
from testbed.recording.axis import recording_folder
from testbed.recording.axis_header import (
    RECORDING,
    AnyHeader,
    ReferenceForce,
    check_format,
    check_kind_of_rig,
    check_quantities,
)
from testbed.recording.checks import check_finite, check_time
from testbed.recording.quantities import quantities_of


class FootScale(Checked):
    """What is declared about a foot: the sizes that a detector measures its force by."""

    nominal_load_n: float | None = Field(default=None, gt=0.0)
    """load of the standing foot, N"""
    breakaway_n: float | None = Field(default=None, ge=0.0)
    """error that friction leaves in the force at rest, N"""


class FootHeader(AnyHeader):
    """The contents of a foot's recording.yaml."""

    rig: Literal["foot"]
    """one foot whose force is known"""
    known: FootScale = FootScale()
    """the foot's own scale"""
    reference_force: ReferenceForce | None = None
    """the true force, to score a contact state against"""


@dataclass(frozen=True, eq=False)
class FootRecording:
    """One foot, one row a sample, length n: time s, load N (+ pressed on the ground), whether it
    carries (or None), the true load N (or None).
    """

    name: str
    folder: Path
    header: FootHeader
    time_s: Array
    force_n: Array
    contact: Flags | None
    reference_n: Array | None


def read_foot(folder: str | Path, missing: bool = False) -> FootRecording:
    """Read and check a recording of one foot. Every fault is an InputError, one line.

    `missing`: forces that are no number are let through.
    """
    folder = recording_folder(folder)
    file = folder / "recording.yaml"
    header = read_foot_header(file)
    channels, table = header.channels, folder / header.data
    wanted = {channel.column: f"channels.{key}.column" for key, channel in channels.items()}
    reference = header.reference_force
    if reference is not None and reference.column is not None:
        wanted.setdefault(reference.column, "reference_force.column")
    columns = read_columns(table, wanted, file)
    series = {
        key: to_si(columns[channel.column], channel.unit) for key, channel in channels.items()
    }
    check_time(series["time"], header.sample_rate_hz, table, file, channels["time"].column)
    for name, values in series.items():
        if not (missing and name == "force"):
            check_finite(name, values, series["time"], table)
    if not np.isfinite(series["force"]).any():
        raise InputError("holds no number", file=table, field="channels.force")
    contact = None
    if "contact" in series:
        contact = as_contact(series["contact"], table, channels["contact"].column)
    true_n = None if reference is None else np.zeros(len(series["time"]))
    if reference is not None and reference.kind == "load-cell" and reference.column:
        true_n = to_si(columns[reference.column], reference.unit or "N")
        check_finite("reference_force", true_n, series["time"], table)
    return FootRecording(
        folder.resolve().name, folder, header, series["time"], series["force"], contact, true_n
    )


def read_foot_header(path: Path) -> FootHeader:
    """Read and check the header of one foot's recording. Every fault is an InputError, one line."""
    tree = read_mapping(path, RECORDING)
    check_format(tree, path)
    check_kind_of_rig(tree, "foot", path)
    header = checked(FootHeader, tree, path)
    check_quantities(header.channels, quantities_of("foot"), path, "foot")
    return header


def as_contact(values: Array, file: Path, column: str, field: str = "channels.contact") -> Flags:
    """Whether the foot carries, (n,): the larger of two values, or any that is not 0 where there is
    only one.

    Raises InputError for more than two distinct values.
    """
    found = np.unique(values)
    if len(found) > 2:
        raise InputError(
            f"column {column!r} has {len(found)} distinct values",
            file=file,
            field=field,
            allowed="at most two distinct values",
        )
    return np.asarray(values == found[-1] if len(found) == 2 else values != 0.0)
