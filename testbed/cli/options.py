"""Options that many commands share."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from testbed.benchmarks.harness import Benchmark
    from testbed.scenario.scenario import Scenario

Json = Annotated[bool, typer.Option("--json", help="Print the answer as JSON on standard output.")]
Shipped = Annotated[str, typer.Argument(help="Scenario file, or the name of a shipped one.")]
Model = Annotated[Path | None, typer.Option(help="Model file that the estimators believe.")]
Gui = Annotated[bool, typer.Option("--gui", help="Show the engine's window.")]
Set = Annotated[
    list[str] | None, typer.Option("--set", help="Change a value: a.b=c. May be repeated.")
]
Seed = Annotated[int | None, typer.Option(help="Seed instead of the scenario's.")]
Jobs = Annotated[int, typer.Option(min=1, help="Processes.")]
Dask = Annotated[
    str | None, typer.Option(help="Scheduler of a Dask cluster, tcp://HOST:PORT, to work there.")
]
Results = Annotated[Path, typer.Option(help="Folder for results and what is finished; resumed.")]
Table = Annotated[Path, typer.Option(help="Table to write: .parquet or .csv.")]


@dataclass(frozen=True)
class Changes:
    """What a command line changes of a scenario."""

    set_: Set = None
    seed: Seed = None
    duration: Annotated[
        float | None, typer.Option(help="Simulated seconds instead of the scenario's.")
    ] = None

    def of(self, scenario: str) -> Scenario:
        """The scenario with these changes. Raises InputError for one that cannot be used."""
        from testbed.scenario.scenario import load_scenario

        return load_scenario(scenario, self.set_ or [], self.seed, self.duration)


@dataclass(frozen=True)
class Work:
    """Where the results of a benchmark or sweep go, who works for them, and how they are shown."""

    out: Results
    jobs: Jobs = 1
    json: Json = False

    def show(self, benchmark: Benchmark[Any]) -> None:
        """Run a benchmark and print its result: JSON, or tables and where the files are."""
        from testbed.benchmarks.harness import run
        from testbed.report.console import answer
        from testbed.simulation.workers import single_threaded

        single_threaded()
        result = run(benchmark, self.out, self.jobs)
        shown = *benchmark.tables(result), self.out / f"{benchmark.name}.json"
        answer(self.json, benchmark.published(result), *shown)


def spread(command: Callable[..., None]) -> Callable[..., None]:
    """A command whose parameters of the classes above are given by options, one for each field."""
    own = inspect.signature(command, eval_str=True).parameters
    groups = {
        name: (given.annotation, inspect.signature(given.annotation, eval_str=True).parameters)
        for name, given in own.items()
        if given.annotation in (Changes, Work)
    }

    @wraps(command)
    def called(**given: Any) -> None:
        made = {
            name: kind(**{field: given.pop(field) for field in fields})
            for name, (kind, fields) in groups.items()
        }
        command(**given, **made)

    parameters = [
        option.replace(kind=option.KEYWORD_ONLY)
        for name, given in own.items()
        for option in (groups[name][1].values() if name in groups else [given])
    ]
    called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    called.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return called
