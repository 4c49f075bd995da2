"""`testbed import`: a recording folder from another tool's file and a map of its columns.

The map is YAML: quantity -> `{column, unit, scale, offset, ..}`, beside `rig`, `known` and
`reference_force` as in recording.yaml. A column becomes `scale * column + offset` in `unit`, then
SI; a pressure in V keeps its calibration.
"""

from __future__ import annotations

import csv
import io
import os
import re
import shutil
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.checked import checked
from testbed.formats.table import in_one_block, open_series, write_columns
from testbed.formats.units import UNITS, to_si
from testbed.formats.yaml_files import read_mapping, write_yaml
from testbed.recording.axis_header import FORMAT, Channel, ReferenceForce
from testbed.recording.checker.check import check_recording
from testbed.recording.checker.finding import Checked as Findings
from testbed.recording.checker.raw import REFERENCE, read_raw
from testbed.recording.importer.mcap_file import read_mcap

SEPARATORS = ("\t", ";", "|", ",", " ")
COMMENTS = ("#", "%", "//", "!")
MOST_BYTES = 10**9
ENDINGS = ".csv, .tsv, .txt, .dat, .parquet, .mcap"
MAP = "YAML: quantity -> {column, unit, scale, offset}, and rig, known, reference_force"
SNIFFED = 50
"""Lines from which the separator is detected."""
MISSING = ["", "NA", "N/A", "#N/A", "n/a", "#NV", "NaN", "nan", "NAN", "-nan", "null", "NULL"]
"""What stands in a cell that has no number."""
_TIME_OF_DAY = re.compile(r"(\d{1,2}):(\d{2}):(\d{2})(?:[.,](\d+))?")
_NUMBER = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?")


def read_any(path: Path, wanted: Mapping[str, str], held: Collection[str] = ()) -> dict[str, Array]:
    """The `wanted` columns (n,), name -> the map's unit, of a CSV, Parquet or MCAP file; a cell
    that is empty or says that it has no number (MISSING) is NaN. `held`: columns that keep their
    value until the next message, where an MCAP has them in another topic than most.

    Raises InputError: no such file, an ending that is not known, a column that is not there, dates
    or times of day in another unit than s.
    """
    if not path.is_file():
        raise InputError("no such file", file=path, allowed=ENDINGS)
    if path.suffix == ".mcap":
        return read_mcap(path, wanted, held)
    if path.suffix == ".parquet":
        names, table = open_series(path, wanted)
    elif path.suffix in (".csv", ".tsv", ".txt", ".dat"):
        table = _read_text(path)
        names = table.column_names
    else:
        raise InputError("unknown ending", file=path, allowed=ENDINGS)
    for name in wanted:
        if name not in names:
            raise InputError(
                f"has no column {name!r}", file=path, allowed=", ".join(map(str, names))
            )
    return {name: _numbers(table.column(name), name, unit, path) for name, unit in wanted.items()}


def _read_text(path: Path) -> Any:
    """A text table as Arrow: separator, decimal sign and comments detected from the text itself."""
    import pyarrow as pa
    import pyarrow.csv

    lines = [
        line
        for line in _decoded(path).splitlines()
        if line.strip() and not line.lstrip().startswith(COMMENTS)
    ]
    if len(lines) < 2:
        raise InputError("holds no table", file=path, allowed="a line of names, then numbers")
    separator = _separator(lines[:SNIFFED], path)
    if separator == " ":
        lines = [" ".join(line.split()) for line in lines]
    cells = _cells(lines[0], separator)
    if all(_NUMBER.fullmatch(cell) for cell in cells):
        names = [str(index + 1) for index in range(len(cells))]  # no names: columns are numbered
    else:
        names, lines = cells, lines[1:]
    if not any(_NUMBER.fullmatch(cell) for cell in _cells(lines[0], separator)):
        lines = lines[1:]  # a line of units below the names
    doubled = {name for name in names if names.count(name) > 1}
    if doubled:
        raise InputError(f"has two columns {sorted(doubled)[0]!r}", file=path)
    cells = [cell for line in lines[:SNIFFED] for cell in _cells(line, separator)]
    comma = any("," in cell and _NUMBER.fullmatch(cell) for cell in cells)
    table = "\n".join(lines).encode()
    try:
        return pa.csv.read_csv(
            io.BytesIO(table),
            read_options=in_one_block(len(table), names),
            parse_options=pa.csv.ParseOptions(delimiter=separator),
            convert_options=pa.csv.ConvertOptions(
                decimal_point="," if comma else ".", null_values=MISSING
            ),
        )
    except pa.ArrowException as error:
        raise InputError(f"is not a readable table: {error}", file=path) from error


def _cells(line: str, separator: str) -> list[str]:
    """The cells of a line without blanks and quotes; a separator within quotes parts nothing."""
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]


def _decoded(path: Path) -> str:
    try:
        if path.stat().st_size > MOST_BYTES:
            raise InputError("is too large", file=path, allowed=f"at most {MOST_BYTES / 1e9:g} GB")
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from error
    try:
        return raw.decode("utf-16" if raw[:2] in UTF_16 else "utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _separator(lines: Sequence[str], path: Path) -> str:
    """The first separator that parts all lines into equally many cells."""
    for separator in SEPARATORS:
        counts = {
            len(_cells(" ".join(line.split()) if separator == " " else line, separator))
            for line in lines
        }
        if len(counts) == 1 and counts != {1}:
            return separator
    raise InputError(
        "its lines do not have equally many cells",
        file=path,
        allowed="cells parted by tab, ; | , or spaces",
    )


def _numbers(column: Any, name: str, unit: str, path: Path) -> Array:
    """A column as float64 (n,); dates, times of day and durations become seconds since the first
    row.
    """
    import pyarrow as pa

    stamps = _stamps_ns(column)
    if stamps is not None:
        if unit != "s":
            raise InputError(
                f"column {name!r} holds times, not numbers: they become seconds",
                file=path,
                field="unit",
                value=unit,
                allowed="s",
            )
        return np.asarray((stamps - stamps[0]) / np.timedelta64(1, "s"), dtype=np.float64)
    if pa.types.is_boolean(column.type):
        column = column.cast("int8")
    try:  # not safe: nanoseconds since 1970 have more digits than a float64, which then rounds
        return np.asarray(column.cast("float64", safe=False).to_numpy(), dtype=np.float64)
    except (pa.ArrowException, ValueError) as error:
        raise InputError(
            f"column {name!r} is not numbers{_first_other(column)}",
            file=path,
            allowed=f"numbers, times of day, ISO dates, or {', '.join(MISSING[1:5])} for none",
        ) from error


def _first_other(column: Any) -> str:
    """In words where a column of text first holds what is no number."""
    cells = enumerate(map(str, column.to_pylist()), 1)
    other = ((row, cell) for row, cell in cells if not _NUMBER.fullmatch(cell.strip()))
    return next((f": {cell!r} in row {row}" for row, cell in other if cell != "None"), "")


def _stamps_ns(column: Any) -> Any:
    """A column of dates, times of day or durations as timedelta64[ns] (n,), NaT where one is
    missing; None of another kind.
    """
    import pyarrow as pa

    kind = column.type
    if pa.types.is_timestamp(kind):
        column = column.cast(pa.timestamp("ns"))
    elif pa.types.is_time(kind):
        column = column.cast(pa.time64("ns"))
    elif pa.types.is_duration(kind):
        column = column.cast(pa.duration("ns"))
    elif pa.types.is_string(kind):
        return _times_of_day(column.to_pylist())
    else:
        return None
    ticks = column.cast("int64")
    missing = column.is_null().to_numpy()
    stamps = ticks.fill_null(0).to_numpy().astype("timedelta64[ns]")
    stamps[missing] = np.timedelta64("NaT")
    return stamps


def _times_of_day(cells: list[str | None]) -> Any:
    """Texts like 23:59:59.125 as timedelta64[ns] (n,), NaT where one is missing; None where a text
    is something else.
    """
    stamps = np.full(len(cells), np.timedelta64("NaT", "ns"))
    for row, cell in enumerate(cells):
        if cell is None:
            continue
        found = _TIME_OF_DAY.fullmatch(cell.strip())
        if found is None:
            return None
        hours, minutes, seconds = (int(part) for part in found.groups()[:3])
        whole = 3600 * hours + 60 * minutes + seconds
        nanoseconds = int((found[4] or "0")[:9].ljust(9, "0"))
        stamps[row] = np.timedelta64(whole * 10**9 + nanoseconds, "ns")
    return stamps


FIELDS = ("rig", "known", REFERENCE, "sample_rate_hz", "description", "source", "licence")
"""What of a map goes into recording.yaml as it is; every other key is a quantity."""
HELD = ("valve_", "contact", "carrying_")
"""How quantities begin that hold between samples."""
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


UTF_16 = (b"\xff\xfe", b"\xfe\xff")
"""How a text in UTF-16 begins, as spreadsheets write one."""


def import_file(file: str | Path, map_file: str | Path, out: str | Path) -> Findings:
    """Write the recording `out` from `file` by the map; what is wrong with it. `out` is there whole
    or not at all.

    Raises InputError for a file, a map or a place that cannot be used.
    """
    file, map_file, out = Path(file), Path(map_file), Path(out)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InputError("is there already", file=out, field="--out", allowed="a new folder")
    tree = read_mapping(map_file, MAP)
    given = tree.pop("channels", {})
    if not isinstance(given, Mapping):
        raise InputError("must be a mapping", file=map_file, field="channels")
    kept = {key: tree.pop(key) for key in (*FIELDS, *ROBOTS) if key in tree}
    sources = {name: _source(name, entry, map_file) for name, entry in {**tree, **given}.items()}
    reference = _reference(kept.get(REFERENCE), map_file)
    wanted = {source.column: source.unit for source in sources.values()}
    if reference is not None and reference.column:
        wanted.setdefault(reference.column, reference.unit or "N")
    held = {s.column for name, s in sources.items() if name.startswith(HELD)}
    raw = read_any(file, wanted, held)
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
    clock = sources.get("time", sources.get("t"))
    time = columns.get("time", columns.get("t"))
    if clock is None or time is None or len(time) < 2:
        raise InputError("is missing or holds no rows", file=map_file, field="time")
    steps = np.diff(time)
    steps = steps[np.isfinite(steps) & (steps > 0.0)]
    if not steps.size:
        raise InputError("never rises", file=map_file, field="time", value=clock.column)
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
