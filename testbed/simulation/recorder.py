"""Writes a run while it goes on, so that a killed run stays readable up to its last second.

Each series (`data`, `truth`) is a folder `<name>.parquet/part-0000000.parquet ...` during the run;
every part is a whole Parquet file that appears at once, under its final name. One file grows hidden
beside the parts, and takes the folder's place at the end. Time is kept as float64, everything else
as float32: 24 bits resolve 0.5 Pa at 80 bar (2 mN on the piston), 4 mN at 50 kN and 30 nm at 0.5 m,
each at least a thousand times finer than the sensor that reads it.
"""

from __future__ import annotations

import os
import queue
import shutil
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.files import make_folder, whole, write_json, write_text
from testbed.formats.yaml_files import yaml_text

SERIES = ("data", "truth")
_ROWS_PER_GROUP = 5_000
_PIECES = 16
"""Pieces of so few rows are made one: a piece of a column takes as much memory beside its rows as a
hundred rows do.
"""
_PACKED = 0.5
"""Bytes on the disk per byte of numbers, measured: 0.46 standing, 0.49 drilling."""


class RunRecorder:
    """Takes blocks of rows and writes them in a thread of its own."""

    def __init__(
        self,
        out_dir: Path,
        data_columns: Sequence[str],
        truth_columns: Sequence[str],
        recording_meta: Mapping[str, Any],
    ) -> None:
        """Writes `recording.yaml` and opens both series.

        Column 0 of each is `t` in s. Raises InputError where the folder cannot be written.
        """
        self.out_dir = Path(out_dir)
        self._schemas = {"data": _schema(data_columns), "truth": _schema(truth_columns)}
        self._joined = {
            name: Joined(self.out_dir / f".{name}.parquet", schema)
            for name, schema in self._schemas.items()
        }
        self._parts = dict.fromkeys(SERIES, 0)
        self._fault: Exception | None = None
        self._queue: queue.Queue[tuple[str, int, npt.NDArray[Any]] | None] = queue.Queue(maxsize=64)
        for name in SERIES:
            if (self.out_dir / f"{name}.parquet").exists():
                raise InputError(
                    "is there already",
                    file=self.out_dir / f"{name}.parquet",
                    allowed="a new folder",
                )
            make_folder(self.out_dir / f"{name}.parquet")
        write_text(self.out_dir / "recording.yaml", yaml_text(recording_meta))
        self._thread = threading.Thread(target=self._write_parts, name="recorder", daemon=True)
        self._thread.start()

    def write(self, data: Array, truth: Array) -> None:
        """Hand over one block, shape (rows, columns) each; the arrays may be used again at once.

        Raises InputError if an earlier block could not be written (disk full, folder gone).
        """
        self._check()
        for name, block in (("data", data), ("truth", truth)):
            if block.ndim != 2 or block.shape[1] != len(self._schemas[name]):
                raise ValueError(
                    f"{name} block has shape {block.shape}, expected (rows, {len(self._schemas[name])})"
                )
            if len(block):
                self._queue.put((name, self._parts[name], np.array(block, order="F")))
                self._parts[name] += 1

    def finish(self, summary: Mapping[str, Any] | None = None) -> None:
        """Write what is left, put single files in place of the parts and write `summary.json`.

        Raises InputError where a part or a file could not be written: the parts that are there
        stay, and are read as the single file would be.
        """
        import pyarrow as pa

        self.close()
        for name in SERIES:
            self._compact(name)
        pa.default_memory_pool().release_unused()  # the summary and the report need some
        if summary is not None:
            write_summary(self.out_dir, summary)

    def close(self) -> None:
        """Write what is left; the parts stay as they are."""
        if self._thread.is_alive():
            self._queue.put(None)
            self._thread.join()
        self._check()

    def _check(self) -> None:
        if isinstance(self._fault, InputError):
            raise self._fault
        if self._fault is not None:
            raise InputError(
                f"cannot be written: {self._fault}", file=self.out_dir
            ) from self._fault

    def _write_parts(self) -> None:
        while (item := self._queue.get()) is not None:
            if self._fault is None:
                try:
                    self._write_part(*item)
                except Exception as error:  # handed to the caller's next write
                    self._fault = error
                    self._drop_joined(error)

    def _write_part(self, name: str, number: int, block: npt.NDArray[Any]) -> None:
        table = _table(block, self._schemas[name])
        path = self.out_dir / f"{name}.parquet" / f"part-{number:07d}.parquet"
        try:
            _write_table(path, table)
        except InputError as error:  # the disk may have room for the parts alone
            if not self._drop_joined(error):
                raise
            _write_table(path, table)
        self._joined[name].add(table)

    def _drop_joined(self, error: Exception) -> bool:
        """Give up the single files; returns whether that made room."""
        return any([joined.give_up(error) for joined in self._joined.values()])

    def _compact(self, name: str) -> None:
        """One file in place of the folder; for an instant only `<name>.parquet.parts` is there."""
        folder, joined = self.out_dir / f"{name}.parquet", self._joined[name]
        aside = self.out_dir / f"{name}.parquet.parts"
        try:
            joined.finish()
            os.rename(folder, aside)
            os.rename(joined.path, folder)
            shutil.rmtree(aside)
        except (OSError, InputError) as error:
            joined.give_up(error)
            why = getattr(error, "strerror", None) or error
            problem = f"its parts are whole, but cannot be made one file: {why}"
            raise InputError(problem, file=folder) from error


class Joined:
    """The single file of a series, hidden beside its parts until the run ends.

    Its groups hold the same rows however the parts were cut: the same run gives the same file.
    """

    def __init__(self, path: Path, schema: Any) -> None:
        self.path, self._schema = path, schema
        self._writer: Any = None
        self._waiting = schema.empty_table()
        self._fault: Exception | None = None

    def add(self, rows: Any) -> None:
        """The next rows, an Arrow table. Where they cannot be written, `finish` says so."""
        import pyarrow as pa

        if self._fault is not None:
            return
        self._waiting = pa.concat_tables([self._waiting, rows])
        if self._waiting.column(0).num_chunks > _PIECES:  # of few rows each, at a low rate
            self._waiting = self._waiting.combine_chunks()
        try:
            while len(self._waiting) >= _ROWS_PER_GROUP:
                self._write(self._waiting.slice(0, _ROWS_PER_GROUP))
                self._waiting = self._waiting.slice(_ROWS_PER_GROUP)
        except OSError as error:
            self.give_up(error)

    def finish(self) -> None:
        """Make it whole. Raises what hindered it: OSError, InputError."""
        if self._fault is not None:
            raise self._fault
        if len(self._waiting) or self._writer is None:
            self._write(self._waiting)
        self._writer.close()
        self._writer, self._waiting = None, self._schema.empty_table()

    def give_up(self, error: Exception) -> bool:
        """Leave the disk to the parts, and say so in `finish`; returns whether that makes room."""
        self._fault, self._waiting = self._fault or error, self._schema.empty_table()
        if self._writer is None:
            return False
        with suppress(OSError):
            self._writer.close()
        self._writer = None
        with suppress(OSError):
            self.path.unlink()
        return True

    def _write(self, rows: Any) -> None:
        import pyarrow.parquet as pq

        if self._writer is None:
            self._writer = pq.ParquetWriter(self.path, self._schema, **_SMALL)
        self._writer.write_table(rows.combine_chunks())


_PLAIN: dict[str, Any] = {"use_dictionary": False, "write_statistics": False}
_QUICK: dict[str, Any] = {"compression": "snappy", **_PLAIN}
"""Of the parts, which are gone at the run's end: two thirds of the time that _SMALL takes."""
_SMALL: dict[str, Any] = {"compression": "zstd", "compression_level": 1, **_PLAIN}
"""Of the single files, which stay."""


def size_bytes(rows: int, columns: Sequence[Sequence[str]]) -> float:
    """About how many bytes a recording of so many rows takes; `columns` of each series."""
    return _PACKED * rows * sum(4 * (len(names) + 1) for names in columns)


def _schema(columns: Sequence[str]) -> Any:
    import pyarrow as pa

    if not columns or columns[0] != "t":
        raise ValueError("the first column of a series is 't'")
    return pa.schema([(name, pa.float64() if name == "t" else pa.float32()) for name in columns])


def _write_table(path: Path, table: Any) -> None:
    """Whole or not at all: readers of a folder skip names with a dot."""
    import pyarrow.parquet as pq

    with whole(path) as hidden:
        pq.write_table(table, hidden, **_QUICK)


def _table(block: npt.NDArray[Any], schema: Any) -> Any:
    import pyarrow as pa

    narrow = block.astype(np.float32)
    arrays = [pa.array(block[:, 0])] + [pa.array(narrow[:, i]) for i in range(1, block.shape[1])]
    return pa.Table.from_arrays(arrays, schema=schema)


def write_summary(folder: Path, summary: Mapping[str, Any]) -> None:
    """`summary.json`, whole or not at all; what is not a finite number becomes null."""
    write_json(folder / "summary.json", summary)
