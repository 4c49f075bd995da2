"""How the help lists commands: under a heading for each family, each with the whole of what it says
it does.
"""

from __future__ import annotations

from itertools import groupby
from typing import Any

import typer
from typer.core import TyperGroup

HEADINGS = {
    "runs": "Simulate, and look at what was simulated",
    "recordings": "Recordings of any rig",
    "models": "What a machine is, how that is found, and policies",
    "benchmarks": "Measure the testbed itself",
}
"""File of a family of commands -> its heading; others are listed after them."""


class CommandList(TyperGroup):
    """A program whose help cuts no description off, and that Ctrl-C aborts."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command. Raises typer.Abort on Ctrl-C, which would else be an exit status that
        nobody explains.
        """
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as interrupt:
            raise typer.Abort from interrupt

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write a section for each family, in the order of the commands."""
        for heading, names in groupby(self.list_commands(ctx), self._heading):
            rows = [(name, _does(self.commands[name].help)) for name in names]
            with formatter.section(heading):
                formatter.write_dl(rows)

    def _heading(self, name: str) -> str:
        module = getattr(self.commands[name].callback, "__module__", "")
        return HEADINGS.get(module.rpartition(".")[2], "Commands")


def _does(description: str | None) -> str:
    """The first paragraph, in one line."""
    return " ".join((description or "").partition("\n\n")[0].split())
