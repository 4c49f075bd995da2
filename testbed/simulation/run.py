"""Conducts one run: builds the world, steps it block by block, records it and sums it up."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from testbed.errors import InputError, SimulationFault
from testbed.formats.files import check_space, plain, write_text
from testbed.formats.yaml_files import write_yaml
from testbed.scenario.scenario import Scenario
from testbed.simulation.description import recording_meta
from testbed.simulation.expectations import unmet
from testbed.simulation.metrics import run_metrics, wanted_columns
from testbed.simulation.outputs import check_out, claimed
from testbed.simulation.pictures import Album
from testbed.simulation.recorder import RunRecorder, size_bytes, write_summary
from testbed.simulation.runs import read_series, same_rows
from testbed.simulation.stability import stability_summary
from testbed.simulation.truth_machine import TRUTH_MACHINE, truth_machine

SUMMARY_FORMAT = "roboclimber-summary/1"
Progress = Callable[[float, str], None]


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
) -> RunResult:
    """Simulate `scenario` and record it under `out` (default `runs/<name>-<seed>[-n]`).

    `progress(simulated_s, word)` is called after every block of one simulated second. The first Ctrl-C ends the run
    after its block, a second one at once: what was recorded is kept and summed up. Raises InputError before anything
    is written where the scenario, the model or the output folder cannot be used, SimulationFault where the simulation
    breaks down.
    """
    from testbed.world.simulation import Simulation

    check_out(out)
    started = time.perf_counter()
    simulation = (
        Simulation(scenario, model=model, gui=gui) if gui else Simulation(scenario, model=model)
    )
    try:
        with claimed(out, scenario.name, scenario.seed) as folder:
            return _record(scenario, simulation, folder, progress, started)
    finally:
        simulation.close()


def _record(
    scenario: Scenario, simulation: Any, folder: Path, progress: Progress | None, started: float
) -> RunResult:
    columns = list(simulation.data_columns), list(simulation.truth_columns)
    check_space(folder, size_bytes(round(scenario.duration_s * scenario.rates.record_hz), columns))
    write_text(
        folder / "scenario.yaml",
        yaml.safe_dump(plain(scenario.model_dump(mode="json")), sort_keys=False),
    )
    if scenario.machine.draw is not None:
        write_yaml(folder / TRUTH_MACHINE, truth_machine(scenario, simulation))
    recorder = RunRecorder(
        folder,
        *columns,
        recording_meta(scenario, simulation.machines.belief, columns[0], simulation.surveyed()),
    )
    result = RunResult(folder, {}, False)
    fault: BaseException | None = None

    def sum_up() -> None:
        wall_s = time.perf_counter() - started
        result.summary = _summary(
            scenario, simulation, folder, columns, result.interrupted, wall_s, fault
        )
        write_summary(folder, result.summary)

    try:
        with _stop_flag() as stopped:
            for simulated_s in _blocks(
                simulation, recorder, scenario.rates.record_hz, Album(folder, scenario.duration_s)
            ):
                if progress is not None:
                    progress(simulated_s, _word(simulation))
                if stopped():
                    result.interrupted = True
                    break
    except SimulationFault as error:
        fault = error
        recorder.write(*simulation.last_rows())  # what led to it
        raise SimulationFault(f"{error}; its last records are in {folder}") from error
    except BaseException as error:
        fault = error
        result.interrupted = True
        raise
    finally:
        _all_of(recorder.finish, sum_up)
    return result


def _all_of(*steps: Callable[[], None]) -> None:
    """Take every step, even where the disk is too full for one; raises the first InputError of them at the end."""
    unwritten: list[InputError] = []
    for step in steps:
        try:
            step()
        except InputError as error:
            unwritten.append(error)
    if unwritten:
        raise unwritten[0]


def _blocks(simulation: Any, recorder: RunRecorder, rows: int, album: Album) -> Iterator[float]:
    """Step, record and picture; yields the simulated time [s] after each block of `rows` rows."""
    now_s = 0.0
    album.take(simulation, now_s)
    while not simulation.finished:
        data, truth = simulation.run_block(rows)
        recorder.write(data, truth)
        now_s = float(truth[-1, 0]) if len(truth) else now_s
        album.take(simulation, now_s)
        yield now_s
    album.take_large(simulation, now_s)


def _word(simulation: Any) -> str:
    events = simulation.events
    return str(events[-1]["kind"]).replace("_", " ") if events else ""


@contextmanager
def _stop_flag() -> Iterator[Callable[[], bool]]:
    """Turns the first Ctrl-C (or SIGTERM) into a flag; a second one interrupts at once."""
    hits: list[int] = []

    def handle(number: int, frame: object) -> None:
        hits.append(number)
        if len(hits) > 1:
            raise KeyboardInterrupt

    try:
        old = {s: signal.signal(s, handle) for s in (signal.SIGINT, signal.SIGTERM)}
    except ValueError:  # not in the main thread: nobody can press Ctrl-C there
        old = {}
    try:
        yield lambda: bool(hits)
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)


def _summary(
    scenario: Scenario,
    simulation: Any,
    folder: Path,
    columns: tuple[list[str], list[str]],
    interrupted: bool,
    wall_s: float,
    fault: BaseException | None,
) -> dict[str, Any]:
    data, truth = same_rows(
        read_series(folder, "data", wanted_columns(columns[0])),
        read_series(folder, "truth", wanted_columns(columns[1])),
    )
    verdict = (
        str(simulation.verdict).replace("_", " ")
        if fault is None
        else f"fault: {fault or type(fault).__name__}"
    )
    simulated_s = float(truth["t"][-1]) if len(truth["t"]) else 0.0
    summary: dict[str, Any] = {
        "format": SUMMARY_FORMAT,
        "scenario": scenario.name,
        "description": scenario.description,
        "seed": scenario.seed,
        "verdict": verdict,
        "interrupted": interrupted,
        "planned_s": scenario.duration_s,
        "simulated_s": simulated_s,
        "wall_s": wall_s,
        "slope_deg": scenario.terrain.slope_deg,
        "task": scenario.task.kind,
        "undeclared": [u.model_dump() for u in scenario.undeclared],
        "machine": scenario.machine.model_dump(),
    }
    if len(truth["t"]) > 1:
        summary |= run_metrics(data, truth, scenario.terrain.slope_deg)
        summary |= stability_summary(scenario, simulation.machines.truth, data, truth)
    summary |= {k: v for k, v in simulation.summary().items() if k not in summary}
    summary["events"] = list(simulation.events)
    if not interrupted and fault is None:
        broken = unmet(scenario.expect, plain(summary))
        summary["expectations"] = {"met": not broken, "unmet": broken}
    return dict(plain(summary))
