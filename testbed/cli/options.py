"""Options that many commands share."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
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
Results = Annotated[Path, typer.Option(help="Folder for results and finished cases; resumed.")]
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


def with_changes(command: Callable[..., None]) -> Callable[..., None]:
    """A command whose parameter `changes` is given by options, one for each field of Changes."""

    @wraps(command)
    def called(**given: Any) -> None:
        changes = Changes(**{field.name: given.pop(field.name) for field in fields(Changes)})
        command(**given, changes=changes)

    options = list(inspect.signature(Changes, eval_str=True).parameters.values())
    parameters: list[inspect.Parameter] = []
    for own in inspect.signature(command, eval_str=True).parameters.values():
        parameters += options if own.name == "changes" else [own]
    called.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [parameter.replace(kind=parameter.KEYWORD_ONLY) for parameter in parameters]
    )
    called.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return called
