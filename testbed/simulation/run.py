"""One run from scenario to folder, with a progress bar, stopped by Ctrl-C."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from testbed.errors import InputError
from testbed.scenario.scenario import Scenario
from testbed.simulation.outputs import check_out

if TYPE_CHECKING:
    from testbed.simulation.live_run import Run, WhenRecorded
    from testbed.world.saved import State

TURN_S = 0.0005
"""How long a thread waits for its turn while a run is recorded."""
Progress = Callable[[float, str], None]


class Watch(Protocol):
    """Somebody who looks at a run on its way and may hold it up."""

    every_s: float
    """Simulated time between two looks."""

    def look(self, run: Run) -> bool:
        """Look, and do to the run whatever is wanted; returns whether it may go on."""
        ...


@dataclass(frozen=True)
class Beginning:
    """A saved state that a run begins from, and what happens at that instant: mappings of `kind`
    and its fields.
    """

    state: State
    happens: Sequence[Mapping[str, Any]] = ()


@dataclass(frozen=True)
class Recording:
    """How a run is recorded (see `Run.record_in`)."""

    pictures: bool = True
    """With rendered pictures for a report, which take as long as some fifteen simulated seconds."""
    when_recorded: WhenRecorded | None = None
    """Told of the folder before its run is summed up."""


@dataclass
class RunResult:
    """What a run left: its folder, its summary and whether it was stopped from outside."""

    folder: Path
    summary: dict[str, Any]
    interrupted: bool


def run_scenario(
    scenario: Scenario,
    out: str | Path | None = None,
    model: str | Path | None = None,
    gui: bool = False,
    progress: Progress | None = None,
    beginning: Beginning | None = None,
    watch: Watch | None = None,
    recording: Recording = Recording(),
) -> RunResult:
    """Simulate `scenario`, from its start or a saved state, and record it under `out`
    (`runs/<name>-<seed>[-n]`).

    `progress(simulated_s, word)` is called after every block of one simulated second, or of the
    seconds that `watch`, who looks before each block, wishes. The first Ctrl-C ends the run after
    its block, a second one at once: what was recorded is kept and summed up. Raises InputError
    before anything is written where the scenario, the model or the output folder cannot be used,
    SimulationFault where the simulation breaks down.
    """
    from testbed.simulation.live_run import Run
    from testbed.world.simulation import Simulation

    check_out(out)
    with Run(Simulation(scenario, model=model, gui=gui), keeps=False) as run:
        if beginning is not None:
            run.restore(beginning.state)
            if run.finished:
                raise InputError(
                    f"is over at the state's {run.t_s:g} s",
                    field="duration_s",
                    value=scenario.duration_s,
                    allowed="a later end, of a run that has not fallen, slid or torn a rope",
                )
            for event in beginning.happens:
                run.happen(**event)
        folder = run.record_in(out, recording.pictures, recording.when_recorded)
        with _stop_flag() as stopped, _short_turns():
            block = round(scenario.rates.physics_hz * (watch.every_s if watch is not None else 1.0))
            while not run.finished:
                if watch is None or watch.look(run):
                    run.step(block)
                if progress is not None:
                    progress(run.t_s, _word(run.events))
                if stopped():
                    run.interrupted = True
                    break
    return RunResult(folder, run.summary(), run.interrupted)


def _word(events: list[dict[str, Any]]) -> str:
    return str(events[-1]["kind"]).replace("_", " ") if events else ""


@contextmanager
def _short_turns() -> Iterator[None]:
    """Lets the thread that records have its many short turns at once: with the interpreter's own
    5 ms it falls behind the run, which then waits for it at the end.
    """
    before_s = sys.getswitchinterval()
    sys.setswitchinterval(min(before_s, TURN_S))
    try:
        yield
    finally:
        sys.setswitchinterval(before_s)


@contextmanager
def _stop_flag() -> Iterator[Callable[[], bool]]:
    """Turns the first Ctrl-C (or SIGTERM) into a flag; a second one interrupts at once."""
    hits: list[int] = []

    def handle(number: int, frame: object) -> None:
        hits.append(number)
        if len(hits) > 1:
            raise KeyboardInterrupt

    try:
        old = {caught: signal.signal(caught, handle) for caught in (signal.SIGINT, signal.SIGTERM)}
    except ValueError:  # not in the main thread: nobody can press Ctrl-C there
        old = {}
    try:
        yield lambda: bool(hits)
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)
