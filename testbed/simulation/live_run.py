"""A run as an object: step it, look at it, bring your own gait, controller, detectors and
estimators.

    with simulate(load_scenario("drill_slope_45"), detectors=["combined", Mine]) as run:
        while not run.finished:
            rows = run.step(100)          # 100 physics steps: 0.1 s at 1 kHz
        run.rows["estimate"]["own"]       # (n, 4) N
        run.truth["foot_load"]            # (n, 4) N
        run.scores["Mine"]                # (n, 4)

Stepped in pieces or at one go, it is the same run to the last bit, and the same as that of `testbed
run`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.control.distribution.distribution import Controller
from testbed.control.gait import Gait
from testbed.control.gaits.table import OwnParts
from testbed.errors import InputError, SimulationFault
from testbed.estimation.detectors.base import Detector
from testbed.estimation.estimator import Estimator
from testbed.formats.arrays import Array, Columns
from testbed.formats.checked import Checked, checked
from testbed.recording.rows import DataRow, TruthRow
from testbed.robot.robot import Robot
from testbed.scenario.events import Event
from testbed.scenario.scenario import Scenario, load_scenario
from testbed.simulation.outputs import check_out, claimed
from testbed.simulation.rows import Rows
from testbed.simulation.run_folder import RunFolder
from testbed.simulation.run_observers import RunObservers
from testbed.simulation.run_summary import Ending, summary_of_run, world_part
from testbed.world.saved import State, read_state
from testbed.world.simulation import Simulation


def simulate(
    scenario: Scenario | str | Path,
    out: str | Path | None = None,
    model: str | Path | None = None,
    gait: str | type[Any] | Gait | None = None,
    controller: str | type[Any] | Controller | None = None,
    detectors: Iterable[str | type[Any] | Detector] = (),
    estimators: Iterable[str | type[Any] | Estimator] = (),
) -> Run:
    """Begin a run of `scenario`: at its start, in equilibrium, not yet stepped.

    out: folder that it is recorded in, as `testbed run --out` does; None records nothing on the
    disk.
    model: model file that the estimators believe.
    gait, controller: instead of the scenario's. A class, an object or `FILE.py:Class`; a controller
    may be a shipped one by name. A gait is made from the BelievedStart. What the task drills and
    which layers lie over it stays.
    detectors, estimators: ride along, fed every recorded row as it comes; shipped detectors by
    name.

    Raises InputError before anything is written where one of these cannot be used.
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    if out is not None:
        check_out(out)
    simulation = Simulation(scenario, model=model, own=OwnParts(gait, controller))
    try:
        dt_s = 1.0 / scenario.rates.record_hz
        observers = RunObservers(detectors, estimators, simulation.machine.chain.belief, dt_s)
    except BaseException:
        simulation.close()
        raise
    run = Run(simulation, observers=observers)
    if out is not None:
        run.record_in(out)
    return run


WhenRecorded = Callable[[Path, dict[str, Any]], None]


class Happening(Checked):
    """What `Run.happen` is given."""

    event: Event


class Run:
    """A run on its way; a context manager that closes it. See the module and `simulate`.

    `keeps`: whether the rows stay in memory (1.5 MB a simulated second at 1 kHz); `rows` and
    `truth` need them.
    """

    def __init__(
        self, simulation: Simulation, *, observers: RunObservers | None = None, keeps: bool = True
    ) -> None:
        self._simulation, self._observers, self._keeps = simulation, observers, keeps
        self.rows, self.truth = Rows(DataRow), Rows(TruthRow)
        """What sensors, estimators and control said, and what only the simulator knows: all rows so
        far.
        """
        self.interrupted = False
        """Closed before it was finished."""
        self._last: tuple[Array, Array] | None = None
        self._folder: RunFolder | None = None
        self._when_recorded: WhenRecorded | None = None
        self._holding = ExitStack()
        self._fault: BaseException | None = None
        self._started = time.perf_counter()
        self._closed: dict[str, Any] | None = None

    def record_in(
        self,
        out: str | Path | None,
        pictures: bool = True,
        when_recorded: WhenRecorded | None = None,
    ) -> Path:
        """Write all that comes to the folder `out` too (None: `runs/<name>-<seed>[-n]`), with
        rendered pictures or without; an earlier run is removed.

        when_recorded: called with the folder and what the world tells of the run (see
        `world_part`) once all rows are in their files, before they are summed up; not where
        rows are lost.

        Returns the folder. Raises InputError, and is closed, where it cannot be written.
        """
        scenario = self._simulation.scenario
        try:
            folder = self._holding.enter_context(claimed(out, scenario.name, scenario.seed))
            self._folder = RunFolder(folder, self._simulation, pictures)
            self._when_recorded = when_recorded
        except BaseException:
            self._closed = {}
            self._holding.close()
            self._simulation.close()
            raise
        return folder

    # ---- stepping --------------------------------------------------------------------------------

    @property
    def dt_s(self) -> float:
        """Simulated time of one step, s."""
        return self._simulation.dt

    @property
    def t_s(self) -> float:
        """Simulated time so far, s."""
        return self._simulation.t_s

    @property
    def finished(self) -> bool:
        """Whether the scenario's time is over, or the machine fell, slid or tore a rope."""
        return self._simulation.finished or self._closed is not None

    def step(self, count: int = 1) -> NDArray[Any]:
        """Make `count` physics steps (`dt_s` each, 1 ms unless the scenario says otherwise), fewer
        where the run ends.

        Returns the rows (DataRow) that were recorded meanwhile, which may be none: rates.record_hz
        a second are. Raises SimulationFault where the simulation breaks down.
        """
        try:
            data, truth = self._simulation.run_steps(count)
        except SimulationFault as error:
            self._fault = error
            if self._folder is None:
                raise
            self._folder.keep(*self._simulation.last_rows())
            where = f"{error}; its last records are in {self._folder.folder}"
            raise SimulationFault(where) from error
        if self._keeps:
            self.rows.add(data)
            self.truth.add(truth)
        if len(data):
            self._last = data[-1:], truth[-1:]
        rows = DataRow.from_table(data)
        if self._observers is not None and len(rows):
            self._observers.take(rows)
        if self._folder is not None:
            self._folder.take(data, truth)
            if self._simulation.finished:
                self._folder.take_last(self.t_s)
        return rows

    # ---- other ways to go on ---------------------------------------------------------------------

    def save(self) -> State:
        """The run at this instant: machine, ground, estimators, gait and all that rides along, to
        the last bit.

        `state.write("here.npz")` keeps it in a file. Raises InputError where a class of your own
        holds what no file can hold.
        """
        return self._simulation.save(*self._observing)

    def restore(self, state: State | str | Path) -> None:
        """Go on from a saved state (or its file) of the same scenario; rows in memory begin there,
        or end there.

        Raises InputError where the state belongs to another run, or where rows are in a folder
        already.
        """
        found = state if isinstance(state, State) else read_state(state)
        if self._folder is not None and self._simulation.t_s > 0.0:
            raise InputError(
                "cannot go back in a run that is recorded in a folder",
                field="restore",
                allowed="a run without `out`, or one that has not been stepped yet",
            )
        self._simulation.restore(found, *self._observing)
        for rows in (self.rows, self.truth):
            rows.end_at(found.t_s)
        self._fault, self.interrupted = None, False

    def branch(self, seed: int | None = None) -> Run:
        """Another run that begins where this one stands and goes its own way, recorded in memory.

        seed: everything random from here on comes from another seed; None: the branch is this run's
        twin. Detectors and estimators that ride along stay here. Raises InputError where a gait or
        controller came as an object.
        """
        return Run(self._simulation.branch(seed))

    def happen(self, kind: str, **fields: Any) -> None:
        """Let an event of the scenario happen now: `run.happen("cut_rope", rope="left")`.

        Raises InputError for an event or a field that there is not, for one that a gait carries
        out, and for a time.
        """
        if "at_s" in fields:
            raise InputError("happens now", field="at_s", value=fields["at_s"], allowed="no time")
        event = {"kind": kind, "at_s": self.t_s, **fields}
        self._simulation.happen(checked(Happening, {"event": event}, "happen").event)

    @property
    def _observing(self) -> tuple[Any, ...]:
        return () if self._observers is None else (self._observers,)

    # ---- looking ---------------------------------------------------------------------------------

    @property
    def folder(self) -> Path | None:
        """Where it is recorded."""
        return None if self._folder is None else self._folder.folder

    @property
    def robot(self) -> Robot:
        """The world's machine, with its bodies."""
        return Robot.of(self._simulation.machines.truth)

    def now(self) -> tuple[Columns, Columns] | None:
        """The last recorded row: columns of `data` and of `truth` with one value each; None before
        the first.
        """
        if self._last is None:
            return None
        names = self._simulation.data_columns, self._simulation.truth_columns
        data, truth = (
            dict(zip(part, columns.T, strict=True))
            for part, columns in zip(names, self._last, strict=True)
        )
        return data, truth

    @property
    def events(self) -> list[dict[str, Any]]:
        """What has happened so far, each with its time `t` in s and its `kind`."""
        return self._simulation.events

    @property
    def scores(self) -> dict[str, Array]:
        """Scores (n, 4) of every detector that rides along, by name."""
        return {} if self._observers is None else self._observers.scores

    @property
    def loads(self) -> dict[str, Array]:
        """Foot loads (n, 4) by every estimator that rides along, by name, N."""
        return {} if self._observers is None else self._observers.loads

    def picture(self, width: int = 840, height: int = 560) -> NDArray[np.uint8]:
        """The machine on its ground now, (height, width, 3)."""
        return self._simulation.picture(width, height)

    def summary(self) -> dict[str, Any]:
        """The contents of `summary.json` as far as the run has come; of a closed run, at its
        end.
        """
        if self._closed is not None:
            return self._closed
        wall_s = time.perf_counter() - self._started
        ending = Ending(wall_s, self.interrupted, self._fault)
        if self._keeps or self._folder is None:
            series: tuple[Columns, Columns] = self.rows.as_recorded(), self.truth.as_recorded()
        else:
            series = self._folder.series()
        return summary_of_run(self._simulation, *series, ending)

    # ---- the end ---------------------------------------------------------------------------------

    def close(self) -> None:
        """End the run where it is, write what is left of its recording, and give the engine
        back.
        """
        if self._closed is not None:
            return
        self.interrupted = self.interrupted or not (self._simulation.finished or self._fault)
        try:
            if self._folder is None:
                self._closed = self.summary()
            else:
                self._folder.finish(self._sum_up)
        finally:
            self._closed = self._closed or {}
            self._holding.close()
            self._simulation.close()

    def _sum_up(self, lost: InputError | None) -> dict[str, Any]:
        if lost is not None and self._fault is None:
            self._fault, self.interrupted = lost, True
        if lost is None and self.folder is not None and self._when_recorded is not None:
            self._when_recorded(self.folder, world_part(self._simulation))
        self._closed = self.summary()
        return self._closed

    def __enter__(self) -> Run:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is not None and self._fault is None:
            self._fault, self.interrupted = error, True
        self.close()
