"""Options that many commands share."""

from __future__ import annotations

from typing import Annotated

import typer

Json = Annotated[bool, typer.Option("--json", help="Print the answer as JSON on standard output.")]
Dask = Annotated[
    str | None, typer.Option(help="Scheduler of a Dask cluster, tcp://HOST:PORT, to work there.")
]
