"""`testbed import`: a recording folder from another tool's file and a map of its columns.

The map is YAML: quantity -> `{column, unit, scale, offset, ..}`, beside `rig`, `known` and
`reference_force` as in recording.yaml. A column becomes `scale * column + offset` in `unit`, then
SI; a pressure in V keeps its calibration.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.checked import checked
from testbed.formats.table import write_columns
from testbed.formats.units import UNITS, to_si
from testbed.formats.yaml_files import read_mapping, write_yaml
from testbed.recording.axis_header import FORMAT, Channel, ReferenceForce
from testbed.recording.checker.check import check_recording
from testbed.recording.checker.finding import Checked as Findings
from testbed.recording.checker.raw import REFERENCE, read_raw
from testbed.recording.importer.tables import read_any

FIELDS = ("rig", "known", REFERENCE, "sample_rate_hz", "description", "source", "licence")
"""What of a map goes into recording.yaml as it is; every other key is a quantity."""
ROBOTS = ("surveyed", "scenario", "seed", "task")


class Source(Channel):
    """Where a quantity comes from."""

    scale: float = 1.0
    """factor of the column"""
    offset: float = 0.0
    """added after the factor, in `unit`"""


class ReferenceSource(ReferenceForce):
    """Where the external force comes from."""

    scale: float = 1.0
    """factor of the column"""
    offset: float = 0.0
    """added after the factor, in `unit`"""


def import_file(file: str | Path, map_file: str | Path, out: str | Path) -> Findings:
    """Write the recording `out` from `file` by the map; what is wrong with it. `out` is there whole
    or not at all.

    Raises InputError for a file, a map or a place that cannot be used.
    """
    file, map_file, out = Path(file), Path(map_file), Path(out)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InputError("is there already", file=out, field="--out", allowed="a new folder")
    tree = read_mapping(map_file)
    given = tree.pop("channels", {})
    if not isinstance(given, Mapping):
        raise InputError("must be a mapping", file=map_file, field="channels")
    kept = {key: tree.pop(key) for key in (*FIELDS, *ROBOTS) if key in tree}
    sources = {name: _source(name, entry, map_file) for name, entry in {**tree, **given}.items()}
    reference = _reference(kept.get(REFERENCE), map_file)
    wanted = {source.column for source in sources.values()}
    if reference is not None and reference.column:
        wanted.add(reference.column)
    raw = read_any(file, wanted)
    columns = {name: _converted(raw[source.column], source) for name, source in sources.items()}
    if reference is not None and reference.column:
        columns[REFERENCE] = _converted(raw[reference.column], reference)
        kept[REFERENCE] = _written_reference(reference)
    header = _header(kept, sources, columns, map_file)
    hidden = out.with_name(f".{out.name}.part")
    try:
        shutil.rmtree(hidden, ignore_errors=True)
        hidden.mkdir(parents=True)
        write_columns(hidden / "data.parquet", columns)
        write_yaml(hidden / "recording.yaml", header)
        _accepted(hidden, map_file)
        if out.is_dir():
            out.rmdir()
        os.replace(hidden, out)
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", file=out, field="--out") from error
    finally:
        shutil.rmtree(hidden, ignore_errors=True)
    return check_recording(out)


def _source(quantity: str, entry: Any, map_file: Path) -> Source:
    """One checked entry of the map. Raises InputError naming the quantity."""
    try:
        source = checked(Source, entry, map_file)
    except InputError as error:
        field = quantity if error.field is None else f"{quantity}.{error.field}"
        raise InputError(
            error.problem, file=map_file, field=field, value=error.value, allowed=error.allowed
        ) from error
    if source.unit not in UNITS:
        raise InputError(
            "unknown unit",
            file=map_file,
            field=f"{quantity}.unit",
            value=source.unit,
            allowed=", ".join(UNITS),
        )
    return source


def _reference(entry: Any, map_file: Path) -> ReferenceSource | None:
    return None if entry is None else checked(ReferenceSource, entry, map_file)


def _converted(values: Array, source: Source | ReferenceSource) -> Array:
    return to_si(source.scale * values + source.offset, source.unit or "N")


def _written_reference(reference: ReferenceSource) -> dict[str, Any]:
    plain = ReferenceForce(**reference.model_dump(exclude={"scale", "offset"})).in_si()
    return plain.model_copy(update={"column": REFERENCE}).model_dump(exclude_none=True)


def _header(
    kept: Mapping[str, Any],
    sources: Mapping[str, Source],
    columns: Mapping[str, Array],
    map_file: Path,
) -> dict[str, Any]:
    """The contents of recording.yaml; the rate is the table's own where the map states none."""
    time = columns.get("time", columns.get("t"))
    if time is None or len(time) < 2:
        raise InputError("is missing or holds no rows", file=map_file, field="time")
    steps = np.diff(time)
    steps = steps[np.isfinite(steps) & (steps > 0.0)]
    if not steps.size:
        raise InputError("never rises", file=map_file, field="time", value=sources["time"].column)
    channels = {}
    for quantity, source in sources.items():
        si = Channel(**source.model_dump(exclude={"scale", "offset"})).in_si()
        channels[quantity] = si.model_copy(update={"column": quantity}).model_dump(
            mode="json", exclude_none=True
        )
    rate = {"sample_rate_hz": float(f"{1.0 / float(np.median(steps)):.6g}")}
    table = {"format": FORMAT, "data": "data.parquet"}
    return {"rig": None, "known": {}, **table, **rate, **kept, "channels": channels}


def _accepted(folder: Path, map_file: Path) -> None:
    """See that a reader takes the header. Raises InputError that names the map in place of what was
    written.
    """
    try:
        read_raw(folder)
    except InputError as error:
        raise InputError(
            error.problem,
            file=map_file,
            field=error.field,
            value=error.value,
            allowed=error.allowed,
        ) from error
