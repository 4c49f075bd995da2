"""A table as data: a title, heads and rows of text; the console and the pages show it, Markdown
here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple


class Table(NamedTuple):
    """What one table shows."""

    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]


def markdown(table: Table) -> str:
    """The table as Markdown, its title as a heading."""
    lines = [table.heads, ["---"] * len(table.heads), *table.rows]
    body = "\n".join(
        f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |" for row in lines
    )
    return f"## {table.title}\n\n{body}\n"
