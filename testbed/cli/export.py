"""The command that writes a run for other people's viewers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from testbed.cli.options import Json

exports = typer.Typer()


@exports.command()
def export(
    run: Annotated[Path, typer.Argument(help="Folder of a run.")],
    out: Annotated[Path, typer.Option(help="File: .csv (PlotJuggler) or .mcap (Foxglove).")],
    rate: Annotated[float, typer.Option(help="Rows a second, at most.")] = 100.0,
    json: Json = False,
) -> None:
    """Write a run as CSV for PlotJuggler, or as MCAP that Foxglove opens (extra mcap)."""
    from testbed.report.console import print_json, waiting
    from testbed.workflows.export import export_run

    with waiting("writing"):
        done = export_run(run, out, rate)
    if json:
        print_json(done)
    else:
        print(f"{done['rows']} rows: {done['out']}")
