"""Columns of numbers from a Parquet or CSV file, and back."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.errors import InputError
from testbed.formats.files import whole

Array = npt.NDArray[np.float64]
MOST_VALUES, MOST_CSV_BYTES = 1_000_000_000, 4_000_000_000
"""Of a table that is read: numbers of the columns asked for (8 GB in memory), and bytes of a CSV
file.
"""


def read_columns(path: Path, wanted: Mapping[str, str], declared_in: Path) -> dict[str, Array]:
    """The columns named in `wanted` (column -> field that names it), as float64 of equal length.

    Of a Parquet file no other column is read; it may be the folder of parts that a killed run
    leaves.
    Raises InputError: missing file, broken table, missing column, a column that is not numbers.
    """
    names, table = _open(path, wanted)
    out: dict[str, Array] = {}
    for column, field in wanted.items():
        if column not in names:
            raise InputError(
                f"{path.name} has no such column",
                file=declared_in,
                field=field,
                value=column,
                allowed=", ".join(names),
            )
        try:
            found = table.column(column)
            if str(found.type) != "double":  # a cast loads all that Arrow computes with
                found = found.cast("float64")
            values = found.to_numpy(zero_copy_only=False)
        except Exception as error:
            raise InputError(f"column {column!r} is not numbers: {error}", file=path) from error
        out[column] = np.ascontiguousarray(values, dtype=np.float64)
    return out


def read_parquet(path: Path, columns: Sequence[str] | None = None) -> Any:
    """The columns named (None: all) of a Parquet file as an Arrow table; quicker to start than
    Arrow's data sets.
    """
    import pyarrow.parquet

    with pyarrow.parquet.ParquetFile(path) as file:
        return file.read(columns=None if columns is None else list(columns), use_threads=False)


def write_columns(path: Path, columns: Mapping[str, Array]) -> None:
    """Write equal-length columns as Parquet or CSV by the file's ending, whole or not at all.

    Raises InputError for another ending or a place that cannot be written.
    """
    import pyarrow as pa
    import pyarrow.csv
    import pyarrow.parquet

    if path.suffix not in (".parquet", ".csv"):
        raise InputError("unknown ending", file=path, allowed=".parquet, .csv")
    table = pa.table({name: np.asarray(values) for name, values in columns.items()})
    with whole(path) as hidden:
        if path.suffix == ".csv":
            pa.csv.write_csv(table, hidden)
        else:
            pa.parquet.write_table(table, hidden)


def _open(path: Path, wanted: Collection[str]) -> tuple[list[str], Any]:
    """The names of all columns, and a table that holds at least the `wanted` ones that are
    there.
    """
    import pyarrow.csv

    if path.suffix == ".parquet":
        return open_series(path, wanted)
    if not path.is_file():
        raise InputError("no such file", file=path)
    if path.suffix != ".csv":
        raise InputError("unknown ending", file=path, allowed=".parquet, .csv")
    if path.stat().st_size > MOST_CSV_BYTES:
        raise InputError("is too large", file=path, allowed=f"at most {MOST_CSV_BYTES} bytes")
    try:
        table = pyarrow.csv.read_csv(path)
    except Exception as error:
        raise InputError(f"is not a readable table: {error}", file=path) from error
    return table.column_names, table


def _check_size(files: Sequence[Path], columns: int) -> None:
    """Refuse a Parquet table that would not fit: well packed, a few bytes can stand for many
    numbers.
    """
    import pyarrow.parquet as pq

    values = columns * sum(pq.read_metadata(file).num_rows for file in files)
    if values > MOST_VALUES:
        raise InputError(
            f"holds {values:.3g} numbers", file=files[0], allowed=f"at most {MOST_VALUES:.0e}"
        )


def open_series(path: Path, wanted: Collection[str] | None = None) -> tuple[list[str], Any]:
    """The names of a Parquet table's columns, and the table of those `wanted` (None: all) that are
    there.

    `path` is a file, or the folder of parts that a run writes until it ends. Raises InputError
    where it is missing or broken.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    aside = path.with_name(f"{path.name}.parts")  # killed in the instant between two renames
    place = path if path.exists() or not aside.exists() else aside
    if not place.exists():
        raise InputError("no such file", file=path)
    parts = sorted(place.glob("part-*.parquet"))
    if place.is_dir() and not parts:
        raise InputError("holds no record yet", file=place)
    if not place.is_dir() and not place.is_file():
        raise InputError("is no regular file", file=place)
    try:
        names = pq.read_schema(parts[0] if parts else place).names
        known = None if wanted is None else [name for name in names if name in wanted]
        _check_size(parts or [place], len(names if known is None else known))
        return names, pq.read_table(place, columns=known) if parts else read_parquet(place, known)
    except (OSError, UnicodeError, pa.ArrowException) as error:
        raise InputError(f"is not a readable table: {error}", file=place) from error
