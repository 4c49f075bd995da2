"""A run's folder while it is written: scenario, rows, pictures, and at the end the summary."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from testbed.errors import InputError
from testbed.formats.arrays import Array, Columns
from testbed.formats.files import check_space, plain, write_text
from testbed.formats.yaml_files import write_yaml, yaml_text
from testbed.simulation.description import recording_meta
from testbed.simulation.pictures import Album
from testbed.simulation.recorder import RunRecorder, size_bytes, write_summary
from testbed.simulation.runs import open_run
from testbed.simulation.truth_machine import TRUTH_MACHINE, truth_machine
from testbed.world.summary import surveyed

LEAST_ROWS_A_PART, LONGEST_WAIT_S = 200, 5.0
"""A part is a simulated second of rows, but at least so many, for its head alone takes 100 kB; rows
that have waited for so long, s on the clock, are written anyhow.
"""


def spelt(scenario: Any) -> str:
    """A scenario with all its values, as its run's folder holds it."""
    return yaml_text(plain(scenario.model_dump(mode="json")))


class RunFolder:
    """Takes a Simulation's rows as they come, with pictures unless nobody is to look at them.
    Raises InputError where the disk has no room for the rows.
    """

    def __init__(self, folder: Path, simulation: Any, pictures: bool = True) -> None:
        scenario = simulation.scenario
        self.folder = folder
        self._columns = list(simulation.data_columns), list(simulation.truth_columns)
        rows = round(scenario.duration_s * scenario.rates.record_hz)
        check_space(folder, size_bytes(rows, self._columns))
        write_text(folder / "scenario.yaml", spelt(scenario))
        if scenario.machine.draw is not None:
            write_yaml(folder / TRUTH_MACHINE, truth_machine(scenario, simulation))
        meta = recording_meta(
            scenario, simulation.machines.belief, self._columns[0], surveyed(simulation)
        )
        copies = not simulation.has_window
        self._album = None
        if pictures:
            self._album = Album(folder, simulation, scenario.duration_s, copies=copies)
        self._recorder = RunRecorder(folder, *self._columns, meta)
        self._rows_a_part = max(scenario.rates.record_hz, LEAST_ROWS_A_PART)
        self._waiting: list[tuple[Array, Array]] = []
        self._written_s = time.monotonic()
        if self._album is not None:
            self._album.take(0.0)

    def take(self, data: Array, truth: Array) -> None:
        """The next rows, and a picture where one is due."""
        self.keep(data, truth)
        waiting = sum(len(rows) for rows, _ in self._waiting)
        if waiting >= self._rows_a_part or time.monotonic() - self._written_s > LONGEST_WAIT_S:
            self._write()
        if len(truth) and self._album is not None:
            self._album.take(float(truth[-1, 0]))

    def take_last(self, now_s: float) -> None:
        """The large picture at the run's end."""
        if self._album is not None:
            self._album.take_large(now_s)

    def keep(self, data: Array, truth: Array) -> None:
        """The next rows, of which no picture is taken."""
        self._waiting.append((data, truth))

    def _write(self) -> None:
        """Hand the rows to the recorder, however small the pieces that they came in."""
        self._written_s = time.monotonic()
        if self._waiting:
            data, truth = (np.concatenate(tables) for tables in zip(*self._waiting, strict=True))
            self._waiting = []
            self._recorder.write(data, truth)

    def finish(self, summary: Callable[[InputError | None], dict[str, Any]]) -> None:
        """Make single files of the rows, and write the summary that is worked out then, told why
        rows are lost.

        Both are tried, even where the disk is too full for one, while the last picture is taken
        beside them; raises the first InputError.
        """
        lost = [*_failing(self._write), *_failing(self._recorder.close)]
        unjoined = _failing(self._recorder.finish)
        told = lost[0] if lost else None
        unsaid = _failing(lambda: write_summary(self.folder, summary(told)))
        untaken = _failing(self._album.finish) if self._album is not None else []
        for error in (*lost, *unjoined, *unsaid, *untaken):
            raise error

    def series(self) -> tuple[Columns, Columns]:
        """The recorded columns: data and truth."""
        run = open_run(self.folder)
        return run.data, run.truth


def _failing(step: Callable[[], object]) -> list[InputError]:
    """Why it could not be done; empty: it was."""
    try:
        step()
    except InputError as error:
        return [error]
    return []
