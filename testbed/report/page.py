"""Pages: one self-contained HTML file each, made from templates; and tables as data, which
the console and the pages show.

What comes from data is escaped by the template engine. A page may run no script but this folder's
`animation.js`, and loads nothing: its content-security policy says so to the browser.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from testbed.formats.intervals import rounded, unit_name
from testbed.formats.yaml_files import read_mapping

if TYPE_CHECKING:
    from markupsafe import Markup

# What things are called, and what the words mean: one list for console, report and documentation.

PAPER = (
    "S. Nabulsi, J. F. Sarria, H. Montes, M. A. Armada: High-Resolution Indirect Feet-Ground Interaction "
    "Measurement for Hydraulic-Legged Robots, IEEE Transactions on Instrumentation and Measurement, 2009, "
    "doi:10.1109/TIM.2009.2017650"
)
"""The publication that the testbed is built around."""

METHOD_NAME = {
    "one_chamber": "one chamber (1)",
    "two_chamber": "two chambers (3)",
    "friction": "less friction (7)",
    "kbf": "filtered (6)",
    "modified_kbf": "modified filter (6)",
    "own": "own",
}
"""Name of an estimate in a recording -> what people read."""
LEG_NAME = {"fl": "front left", "fr": "front right", "rl": "rear left", "rr": "rear right"}


class Word(NamedTuple):
    """A word or a few of one kind, and what is meant by it."""

    word: str
    meaning: str


@cache
def words(*topics: str) -> tuple[Word, ...]:
    """The words of these topics of words.yaml, of all for none."""
    given = {"paper": PAPER, **METHOD_NAME}
    by_topic = read_mapping(Path(__file__).with_name("words.yaml"))
    return tuple(
        Word(word.format(**given), meaning.format(**given))
        for topic in topics or by_topic
        for word, meaning in by_topic[topic].items()
    )


def method_name(method: str) -> str:
    """What a person calls an estimate; a user's own keeps its name."""
    return METHOD_NAME.get(method, method.replace("_", " "))


def significant(value: float, digits: int = 4) -> str:
    """A number to so many significant digits; large ones without a power of ten."""
    return f"{float(f'{value:.{digits}g}'):.15g}"


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
    own = {"unit": unit_name, "significant": significant, "rounded": rounded}
    environment.filters.update({**own, **(filters or {})})
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
