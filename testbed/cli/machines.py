"""Commands about machines of one's own."""

from __future__ import annotations

from typing import Annotated

import typer

from testbed.cli.options import Json

machines = typer.Typer()


@machines.command()
def machine(
    folder: Annotated[
        str, typer.Argument(help="Folder of a machine, or the name of a shipped one.")
    ],
    draw: Annotated[
        bool, typer.Option("--draw", help="Draw its robot.urdf anew from its numbers.")
    ] = False,
    json: Json = False,
) -> None:
    """Check the folder of a machine of your own: what it weighs, reaches and can lift.

    Draws its URDF where it has none.
    """
    from testbed.report.console import print_json, print_table
    from testbed.workflows.machines import HEADS, check_machine

    found = check_machine(folder, draw)
    if json:
        print_json(found)
    else:
        rows = [[name, str(value), unit] for name, (value, unit) in found["figures"].items()]
        print_table(found["name"], HEADS, rows)
        print(found["folder"])
