"""Columns of numbers from a Parquet or CSV file, and back."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from testbed.errors import InputError, check_one_of
from testbed.formats.arrays import Array
from testbed.formats.files import whole

MOST_VALUES, MOST_CSV_BYTES = 1_000_000_000, 4_000_000_000
"""Of a table that is read: numbers of the columns asked for (8 GB in memory), and bytes of a CSV
file.
"""
BATCH_ROWS = 8192
"""Rows of a series that are unpacked at a time."""


def read_columns(path: Path, wanted: Mapping[str, str], declared_in: Path) -> dict[str, Array]:
    """The columns named in `wanted` (column -> field that names it), as float64 of equal length.

    Of a Parquet file no other column is read; it may be the folder of parts that a killed run
    leaves. Raises InputError: missing file, broken table, missing column, a column that is not
    numbers.
    """
    names, table = _open(path, wanted)
    out: dict[str, Array] = {}
    for column, field in wanted.items():
        check_one_of(column, names, field, f"{path.name} has no such column", declared_in)
        try:
            found = table.column(column)
            if str(found.type) != "double":  # a cast loads all that Arrow computes with
                found = found.cast("float64", safe=False)  # digits beyond a float64's are rounded
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
        table = pyarrow.csv.read_csv(path, read_options=in_one_block(path.stat().st_size))
    except Exception as error:
        raise InputError(f"is not a readable table: {error}", file=path) from error
    return table.column_names, table


def in_one_block(size: int, names: Sequence[str] | None = None) -> Any:
    """Arrow's way to read a CSV of `size` bytes in one go, by one thread; `names` of its columns,
    where it has no line of them.

    By default several threads read it megabyte by megabyte, and on a busy machine a table once
    ended with the first of them (Arrow 26): no error was reported.
    """
    import pyarrow.csv

    most = 2**31 - 1
    block = min(max(size + 1, 1 << 20), most)
    return pyarrow.csv.ReadOptions(use_threads=False, block_size=block, column_names=names)


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
    import pyarrow.parquet as pq

    files = _files_of(path)
    with readable(files[0]):
        names, known = _names(files, wanted)
        one = len(files) == 1
        return names, read_parquet(files[0], known) if one else pq.read_table(files, columns=known)


def read_numbers(path: Path, wanted: Collection[str] | None = None) -> dict[str, Array]:
    """The columns of a Parquet table, those `wanted` (None: all) that are there, as float64: some
    rows at a time, so that memory holds hardly more than what is asked for.

    `path` as in `open_series`. Raises InputError where it is missing or broken, ValueError or
    TypeError for a column that is not numbers.
    """
    import pyarrow.parquet as pq

    files = _files_of(path)
    with readable(files[0]):
        _, known = _names(files, wanted)
        count = sum(pq.read_metadata(file).num_rows for file in files)
        out = {name: np.empty(count) for name in known}
        first = 0
        for file in files:
            with pq.ParquetFile(file) as opened:
                for batch in opened.iter_batches(BATCH_ROWS, columns=known, use_threads=False):
                    rows = slice(first, first + batch.num_rows)
                    for name in known:
                        out[name][rows] = batch.column(name).to_numpy(zero_copy_only=False)
                    first += batch.num_rows
    return out


def _files_of(path: Path) -> list[Path]:
    """The file, or the parts of the folder, of a Parquet table. Raises InputError where there are
    none.
    """
    aside = path.with_name(f"{path.name}.parts")  # killed in the instant between two renames
    place = path if path.exists() or not aside.exists() else aside
    if not place.exists():
        raise InputError("no such file", file=path)
    parts = sorted(place.glob("part-*.parquet"))
    if place.is_dir() and not parts:
        raise InputError("holds no record yet", file=place)
    if not place.is_dir() and not place.is_file():
        raise InputError("is no regular file", file=place)
    return parts or [place]


def _names(files: Sequence[Path], wanted: Collection[str] | None) -> tuple[list[str], list[str]]:
    """All columns' names, and those that are wanted. Raises InputError for too large a table."""
    import pyarrow.parquet as pq

    names = list(pq.read_schema(files[0]).names)
    known = names if wanted is None else [name for name in names if name in wanted]
    _check_size(files, len(known))
    return names, known


@contextmanager
def readable(file: Path) -> Iterator[None]:
    """Context that calls damage by the file's name."""
    import pyarrow as pa

    try:
        yield
    except (OSError, UnicodeError, pa.ArrowException) as error:
        raise InputError(f"is not a readable table: {error}", file=file) from error
