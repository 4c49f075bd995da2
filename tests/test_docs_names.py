"""What pages name is there: modules, files, commands and their options."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from testbed.cli import app

ROOT = Path(__file__).parents[1]
PAGES = sorted(
    [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")],
)
FOLDERS = "testbed", "tests", "docs", "scenarios", "urdf", "examples"
COMMANDS = typer.main.get_command(app)


def _dotted(text: str) -> Iterator[str]:
    yield from re.findall(r"`(testbed(?:\.[A-Za-z_]+)+)", text)


def _stands(name: str) -> bool:
    """Whether a dotted name is a module, or stands in the module that its beginning is."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        place = ROOT.joinpath(*parts[:count])
        for file in (place.with_suffix(".py"), place / "__init__.py"):
            if file.exists():
                rest = parts[count : count + 1]
                return all(re.search(rf"\b{word}\b", file.read_text()) for word in rest)
    return False


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_modules_and_files_that_a_page_names_are_there(page: Path) -> None:
    text = page.read_text()
    assert [name for name in _dotted(text) if not _stands(name)] == []
    files = re.findall(rf"`((?:{'|'.join(FOLDERS)})/[A-Za-z0-9_./-]+)`", text)
    places = (ROOT, page.parent)
    assert [f for f in files if not any((place / f).exists() for place in places)] == []


def _asked(text: str) -> Iterator[list[str]]:
    """Words of every command of ours that a page tells, in a line of code or in the text."""
    blocks = re.findall(r"```[a-z]*\n(.*?)```", text, re.DOTALL)
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    for told in [*lines, *re.findall(r"`(testbed [^`\n]+)`", text)]:
        line = told.split(" #")[0].strip().removeprefix("$ ")
        if line.startswith("testbed "):
            yield shlex.split(line, posix=False)[1:]


def _wrong(words: list[str]) -> list[str]:
    """What of a command and its options there is not."""
    command: Any = COMMANDS
    while words and hasattr(command, "commands"):
        if words[0].startswith("-"):
            return []
        if words[0] not in command.commands:
            return [words[0]] if words[0].islower() else []
        command, words = command.commands[words[0]], words[1:]
    known = {name for option in command.params for name in (*option.opts, *option.secondary_opts)}
    asked = [word.split("=")[0] for word in words if word.startswith("--")]
    return [name for name in asked if name not in {*known, "--help", "--debug"}]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_that_a_page_tells_are_there_with_their_options(page: Path) -> None:
    asked = list(_asked(page.read_text()))
    assert [words for words in asked if _wrong(words)] == []


def test_a_command_or_an_option_that_is_none_is_seen() -> None:
    text = "`testbed runn X` and `testbed run X --sed 1`, but `testbed run X --seed 1`"
    assert [_wrong(words) for words in _asked(text)] == [["runn"], ["--sed"], []]
    assert not _stands("testbed.benchmarks.speed.environments")
    assert _stands("testbed.benchmarks.speed.bench.against_bare")
