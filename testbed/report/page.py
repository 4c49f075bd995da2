"""Pages: one self-contained HTML file each, made from templates; and tables as data, which
the console and the pages show.

What comes from data is escaped by the template engine. A page may run no script but this folder's
`animation.js`, and
loads nothing: its content-security policy says so to the browser.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable, Mapping
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from markupsafe import Markup

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


SCRIPT = "animation.js"
Filters = Mapping[str, Callable[..., str]]


def render(template: str, contents: Mapping[str, Any], filters: Filters | None = None) -> str:
    """The text of a page. `template`: a file of this folder, or a path below the package.

    `filters`: what the template calls beside Jinja's own.
    """
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    places = [PackageLoader("testbed.report", "."), PackageLoader("testbed", ".")]
    environment = Environment(
        loader=ChoiceLoader(places), autoescape=True, trim_blocks=True, undefined=StrictUndefined
    )
    environment.filters.update(filters or {})
    environment.globals.update(policy=policy(), script=script(SCRIPT))
    return environment.get_template(template).render(**contents)


def policy(*more: str, asks: str = "'none'") -> str:
    """The content-security policy of a page: our scripts by their hashes, styles, and pictures that
    the page holds.

    `more`: scripts of this folder beside the moving picture's. `asks`: whom they may ask for data.
    """
    hashes = " ".join(f"'sha256-{_digest(name)}'" for name in (SCRIPT, *more))
    return (
        f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; connect-src {asks}; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )


def script(name: str) -> Markup:
    """A script of this folder, for a template."""
    from markupsafe import Markup

    return Markup(_script(name))


def _digest(name: str) -> str:
    return base64.b64encode(hashlib.sha256(_script(name).encode()).digest()).decode()


@cache
def _script(name: str = SCRIPT) -> str:
    return files("testbed.report").joinpath(name).read_text(encoding="utf-8")
