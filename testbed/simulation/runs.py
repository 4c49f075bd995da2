"""Reads a run's folder back: finished, interrupted or killed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from testbed.errors import InputError
from testbed.formats.arrays import Array, Columns
from testbed.formats.files import check_links, read_json
from testbed.formats.table import read_numbers, readable
from testbed.formats.yaml_files import read_yaml
from testbed.machine.build import build_machine
from testbed.recording.former import current, with_former
from testbed.scenario.machines import Machines, machines_of
from testbed.scenario.scenario import Scenario, load_scenario

SCENARIO = "scenario.yaml"


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """One run: `data` is what sensors and estimators said, `truth` what only the simulator
    knows.
    """

    folder: Path
    meta: dict[str, Any]
    data: Columns
    truth: Columns
    summary: dict[str, Any] | None
    """None where the run was killed before it could be summed up."""

    @property
    def time_s(self) -> Array:
        """Time of the data's rows [s]."""
        return self.data["t"]

    def frame(self) -> Any:
        """`data` as a pandas.DataFrame over time [s]. Raises InputError where pandas is not
        installed.
        """
        try:
            import pandas
        except ImportError as error:
            raise InputError("needs pandas", field="frame", allowed="pip install pandas") from error
        return pandas.DataFrame(self.data).set_index("t")


def read_run(
    folder: str | Path, columns: Iterable[str] | None = None, truth: bool = True
) -> RecordedRun:
    """Read a run folder; `columns` limits both series to those names (`t` always comes along).

    Raises InputError where there is no run, or where a file of it cannot be read.
    """
    folder = check_run(folder)
    meta = read_yaml(folder / "recording.yaml")
    if not isinstance(meta, dict) or meta.get("rig") != "robot":
        rig = meta.get("rig") if isinstance(meta, dict) else meta
        raise InputError(
            "is not a run of the whole robot",
            file=folder / "recording.yaml",
            field="rig",
            value=rig,
            allowed="robot",
        )
    wanted = None if columns is None else ["t", *(column for column in columns if column != "t")]
    data: Columns = read_series(folder, "data", wanted)
    true: Columns = {}
    if truth:
        data, true = same_rows(data, read_series(folder, "truth", wanted))
    return RecordedRun(folder, meta, data, true, _summary(folder))


def open_run(folder: str | Path) -> RecordedRun:
    """A run of which each column is read when it is asked for: a report looks at some of them, one
    after the other.

    Raises InputError as read_run does.
    """
    times = read_run(folder, ())
    data, truth = (_opened(times.folder, name, len(times.time_s)) for name in ("data", "truth"))
    return replace(times, data=data, truth=truth)


def _opened(folder: Path, name: str, rows: int) -> Columns:
    """The first `rows` of a series."""
    if (folder / f"{name}.parquet").is_file():
        return Series(folder / f"{name}.parquet", rows)
    parts = read_series(folder, name)  # of a run that was killed
    return {column: values[:rows] for column, values in parts.items()}


class Series(Mapping[str, Array]):
    """Columns of a run's file by their names, each read when it is asked for; the last ones stay in
    memory, as many as KEPT_BYTES hold and FEWEST_KEPT at least.
    """

    KEPT_BYTES, FEWEST_KEPT = 16_000_000, 4

    def __init__(self, path: Path, rows: int) -> None:
        """Of its columns the first `rows`. Raises InputError where it is no readable table."""
        import pyarrow.parquet as pq

        with readable(path):
            self._file = pq.ParquetFile(path, pre_buffer=False)  # half the time a column
        self._path, self._rows = path, rows
        self._stored = {current(name): name for name in self._file.schema_arrow.names}
        kept = max(self.KEPT_BYTES // (8 * max(rows, 1)), self.FEWEST_KEPT)
        self._column = lru_cache(kept)(self._read)

    def _read(self, name: str) -> Array:
        with readable(self._path):
            column = self._file.read([self._stored[name]], use_threads=False).column(0)
        try:
            return np.asarray(column.to_numpy(), dtype=float)[: self._rows]
        except (ValueError, TypeError) as error:
            raise InputError(f"holds what is no number: {error}", file=self._path) from error

    def __getitem__(self, name: str) -> Array:
        if name not in self._stored:
            raise KeyError(name)
        return self._column(name)

    def __contains__(self, name: object) -> bool:
        return name in self._stored

    def __iter__(self) -> Iterator[str]:
        return iter(self._stored)

    def __len__(self) -> int:
        return len(self._stored)


def same_rows(data: Columns, truth: Columns) -> tuple[Columns, Columns]:
    """Both up to the last row that both have: a killed run, or a full disk, may lack the last
    second of one.
    """
    rows = min(len(data["t"]), len(truth["t"]))
    if len(data["t"]) == len(truth["t"]):
        return data, truth
    first, second = (
        {name: column[:rows] for name, column in series.items()} for series in (data, truth)
    )
    return first, second


def check_run(folder: str | Path) -> Path:
    """The folder. Raises InputError where it holds no recording."""
    folder = Path(folder)
    if not (folder / "recording.yaml").is_file():
        raise InputError("holds no run", file=folder, allowed="a folder with recording.yaml")
    return check_links(folder)


def read_series(folder: Path, name: str, columns: list[str] | None = None) -> dict[str, Array]:
    """Columns of `<name>.parquet`, float64, under today's names; names that the series lacks are
    left out.

    Raises InputError where the series is missing or broken.
    """
    wanted = None if columns is None else with_former(columns)
    path = folder / f"{name}.parquet"
    try:
        found = {current(key): values for key, values in read_numbers(path, wanted).items()}
    except (ValueError, TypeError) as error:
        raise InputError(f"holds what is no number: {error}", file=path) from error
    timed = columns is None or "t" in columns
    if timed and not ("t" in found and (np.diff(found["t"]) > 0.0).all()):
        raise InputError("has no times that rise", file=path, field="column t")
    return found


def _summary(folder: Path) -> dict[str, Any] | None:
    path = folder / "summary.json"
    if not path.is_file():
        return None
    return read_json(path)


def run_machines(folder: str | Path) -> Machines:
    """The machines of a run by its `scenario.yaml`; the shipped one where a folder holds none."""
    scenario = run_scenario_of(folder)
    if scenario is None:
        return Machines(build_machine(), build_machine())
    return machines_of(scenario, Path(folder) / SCENARIO)


def run_scenario_of(folder: str | Path) -> Scenario | None:
    """The scenario that a run was made from; None where its folder holds none."""
    path = Path(folder) / SCENARIO
    return load_scenario(path) if path.is_file() else None
