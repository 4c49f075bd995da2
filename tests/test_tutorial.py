"""The README's tutorial does what it says: its code is taken out and run."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from testbed.cli import app

README = Path(__file__).parents[1] / "README.md"
SECTION = README.read_text().partition("## Your own controller")[2].partition("\n## ")[0]


def _blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", SECTION, re.DOTALL)


def test_the_tutorial_is_short() -> None:
    assert 30 <= SECTION.count("\n") <= 75


def test_a_controller_in_and_a_table_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its file, its command, on one case instead of twenty in one process instead of two."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(_blocks("python")[0])
    command = re.sub(r"--cases \d+ --jobs \d+", "--cases 1", _blocks("sh")[0])
    done = CliRunner().invoke(app, shlex.split(command)[1:])
    assert done.exit_code == 0, done.output
    head = _blocks("text")[0].splitlines()
    assert all(word in done.output for word in ("mine.py:Mine", "qp", "oracle"))
    assert any("mine.py:Mine" in line for line in head)
    result = json.loads((tmp_path / "compared" / "distribution.json").read_text())
    assert [entry["name"] for entry in result["controllers"]] == ["mine.py:Mine", "qp", "oracle"]
    assert 0.0 < result["controllers"][0]["friction_use_median"] <= 1.5


def test_the_environment_of_the_tutorial_steps() -> None:
    scope: dict[str, object] = {}
    exec(_blocks("python")[1], scope)
    scope["env"].close()  # type: ignore[attr-defined]
    assert scope["observation"].shape == (41,) and scope["terminated"] is False  # type: ignore[attr-defined]
