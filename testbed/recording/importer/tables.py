"""Tables as other tools write them: columns of numbers by name, whatever the separator or
container.
"""

from __future__ import annotations

import io
import re
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.table import open_series
from testbed.recording.importer.mcap_file import read_mcap

SEPARATORS = ("\t", ";", "|", ",", " ")
COMMENTS = ("#", "%", "//", "!")
MOST_BYTES = 10**9
SNIFFED = 50
"""Lines from which the separator is told."""
_NUMBER = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?")


def read_any(path: Path, wanted: Collection[str]) -> dict[str, Array]:
    """The `wanted` columns (n,) of a CSV, Parquet or MCAP file; a cell that is empty or no number
    is NaN.

    Raises InputError: no such file, an ending that is not known, a column that is not there.
    """
    if not path.is_file():
        raise InputError("no such file", file=path)
    if path.suffix == ".mcap":
        return read_mcap(path, wanted)
    if path.suffix == ".parquet":
        names, table = open_series(path, wanted)
    elif path.suffix in (".csv", ".tsv", ".txt", ".dat"):
        table = _read_text(path)
        names = table.column_names
    else:
        raise InputError(
            "unknown ending", file=path, allowed=".csv, .tsv, .txt, .dat, .parquet, .mcap"
        )
    for name in wanted:
        if name not in names:
            raise InputError(
                f"has no column {name!r}", file=path, allowed=", ".join(map(str, names))
            )
    return {name: _numbers(table.column(name), name, path) for name in wanted}


def _read_text(path: Path) -> Any:
    """A text table as Arrow: separator, decimal sign and comments told from the text itself."""
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
    cells = [cell.strip().strip('"') for cell in lines[0].split(separator)]
    if all(_NUMBER.fullmatch(cell) for cell in cells):
        names = [str(index + 1) for index in range(len(cells))]  # no names: columns are numbered
    else:
        names, lines = cells, lines[1:]
    if not any(_NUMBER.fullmatch(cell.strip()) for cell in lines[0].split(separator)):
        lines = lines[1:]  # a line of units below the names
    doubled = {name for name in names if names.count(name) > 1}
    if doubled:
        raise InputError(f"has two columns {sorted(doubled)[0]!r}", file=path)
    comma = separator != "," and any(re.search(r"\d,\d", line) for line in lines[:SNIFFED])
    try:
        return pa.csv.read_csv(
            io.BytesIO("\n".join(lines).encode()),
            read_options=pa.csv.ReadOptions(column_names=names),
            parse_options=pa.csv.ParseOptions(delimiter=separator),
            convert_options=pa.csv.ConvertOptions(
                decimal_point="," if comma else ".", null_values=["", "NA", "NaN", "nan", "null"]
            ),
        )
    except pa.ArrowException as error:
        raise InputError(f"is not a readable table: {error}", file=path) from error


def _decoded(path: Path) -> str:
    try:
        if path.stat().st_size > MOST_BYTES:
            raise InputError("is too large", file=path, allowed=f"at most {MOST_BYTES / 1e9:g} GB")
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from error
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _separator(lines: Sequence[str], path: Path) -> str:
    """The first separator that parts all lines into equally many cells."""
    for separator in SEPARATORS:
        counts = {
            len(line.split() if separator == " " else line.split(separator)) for line in lines
        }
        if len(counts) == 1 and counts != {1}:
            return separator
    raise InputError(
        "its lines do not have equally many cells",
        file=path,
        allowed="cells parted by tab, ; | , or spaces",
    )


def _numbers(column: Any, name: str, path: Path) -> Array:
    """A column as float64 (n,); times of day become seconds since the first row."""
    import pyarrow as pa

    kind = column.type
    if pa.types.is_timestamp(kind):
        stamps = column.cast(pa.timestamp("ns")).to_numpy().astype("datetime64[ns]")
        return np.asarray((stamps - stamps[0]).astype(np.int64) * 1e-9)
    if pa.types.is_boolean(kind):
        column = column.cast("int8")
    try:
        return np.asarray(column.cast("float64").to_numpy(), dtype=np.float64)
    except (pa.ArrowException, ValueError) as error:
        raise InputError(f"column {name!r} is not numbers: {error}", file=path) from error
