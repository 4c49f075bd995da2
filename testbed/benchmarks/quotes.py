"""Numbers that pages quote from committed results: where each stands, and which result it comes
from.

`docs/quotes.yaml` lists them. A quote is a piece of a page's text, a pair of braces for every
number in it, and as many
sources: `100 * recall_interval95/0` is a hundred times the first entry of that list in the result's
JSON file.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from string import Formatter
from typing import Annotated, Any

from pydantic import Field

from testbed.errors import InputError
from testbed.formats.checked import Checked, Sequence, checked
from testbed.formats.files import read_text, write_text
from testbed.formats.yaml_files import read_mapping

QUOTES = Path("docs/quotes.yaml")
MOST_BYTES = 4_000_000
NUMBER = r"([+-]?\d+(?:\.\d+)?)"
_PLACE = re.compile(r"\{(:[^}]*)?\}")


class Line(Checked):
    """A piece of text with numbers, and the sources of these."""

    text: str
    numbers: Annotated[tuple[str, ...], Sequence]


class Group(Checked):
    """The lines of one page that quote one result. `at`: what the paths of all sources begin
    with.
    """

    page: str
    result: str
    at: str = ""
    lines: Annotated[tuple[Line, ...], Sequence]


class Quotes(Checked):
    """All quotes, and beginnings of the README's lines whose numbers no committed result holds yet,
    each with why.
    """

    quoted: Annotated[tuple[Group, ...], Sequence]
    without_result: dict[str, str] = Field(default_factory=dict)


class ZeroWithoutSign(Formatter):
    """Formats numbers as `str.format`, but for one that rounds to zero: that has no sign."""

    def format_field(self, value: Any, format_spec: str) -> str:
        """A number in the form that is wanted."""
        text = str(super().format_field(value, format_spec))
        return text.removeprefix("-") if re.fullmatch(r"-0(\.0+)?", text) else text


@dataclass(frozen=True)
class Quote:
    """One line of a page as it ought to be."""

    page: Path
    text: str
    values: tuple[Any, ...]

    @property
    def wanted(self) -> str:
        """The text with the result's numbers."""
        return ZeroWithoutSign().format(self.text, *self.values)

    @property
    def pattern(self) -> re.Pattern[str]:
        """The text with any numbers."""
        literal = _PLACE.split(self.text)[::2]
        return re.compile(NUMBER.join(map(re.escape, literal)))

    def refreshed(self, page: str) -> str:
        """A page's text with this quote's numbers. Raises InputError where the text is not there
        exactly once.
        """
        found = self.pattern.findall(page)
        if len(found) != 1:
            raise InputError(
                f"stands {len(found)} times in the page",
                file=self.page,
                field="text",
                value=self.text,
                allowed="once",
            )
        return self.pattern.sub(lambda _: self.wanted, page)


def read_quotes(root: Path = Path()) -> tuple[list[Quote], dict[str, str]]:
    """Every quote of a tree's pages, and its lines without a result. Raises InputError for what
    cannot be found.
    """
    file = root / QUOTES
    listed = checked(Quotes, read_mapping(file), file)
    found = []
    for group in listed.quoted:
        result = json.loads(read_text(root / group.result, MOST_BYTES))
        for line in group.lines:
            paths = [_under(group.at, number) for number in line.numbers]
            values = tuple(_value(result, path, root / group.result) for path in paths)
            if len(values) != len(_PLACE.findall(line.text)):
                raise InputError(
                    "has another number of sources than of braces",
                    file=file,
                    field="numbers",
                    value=line.text,
                )
            found.append(Quote(root / group.page, line.text, values))
    return found, listed.without_result


def refresh(root: Path = Path()) -> list[Path]:
    """Put the committed results' numbers into the pages; returns the pages that changed."""
    quotes, _ = read_quotes(root)
    changed = []
    for page in dict.fromkeys(quote.page for quote in quotes):
        before = text = read_text(page, MOST_BYTES)
        for quote in quotes:
            if quote.page == page:
                text = quote.refreshed(text)
        if text != before:
            write_text(page, text)
            changed.append(page)
    return changed


def _under(place: str, number: str) -> str:
    """`100 * path` at a place: `100 * place/path`."""
    factor, star, path = number.rpartition("*")
    return f"{factor}{star}{place}/{path.strip()}" if place else number


def _value(result: Any, number: str, file: Path) -> Any:
    """What a source says: a path of keys, of places in lists, or of `key=value` of an entry of a
    list.
    """
    factor, _, path = number.rpartition("*")
    found = result
    for key in path.strip().split("/"):
        try:
            found = _step(found, key)
        except (KeyError, IndexError, ValueError, StopIteration) as error:
            raise InputError("holds no such number", file=file, field=path) from error
    return found * float(factor) if factor else found


def _step(found: Any, key: str) -> Any:
    if not isinstance(found, list):
        return found[key]
    name, equals, value = key.partition("=")
    if equals:
        return next(entry for entry in found if str(entry[name]) == value)
    return found[int(key)]
