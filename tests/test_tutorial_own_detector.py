"""The tutorial of one's own detector does what it says: its code is taken out and run."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from testbed.cli import app
from testbed.simulation.runs import read_series

PAGE = (Path(__file__).parents[1] / "docs" / "tutorials" / "own_detector.md").read_text()


def _block(language: str) -> str:
    found = re.search(rf"```{language}[^\n]*\n(.*?)```", PAGE, re.DOTALL)
    assert found is not None
    return found[1]


def test_a_detector_in_and_contact_states_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert PAGE.count("\n") <= 60
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(_block("python"))
    done = CliRunner().invoke(app, shlex.split(_block("sh"))[1:])
    assert done.exit_code == 0, done.output
    contact = read_series(tmp_path / "run", "data")["contact_fl"]
    assert np.all(np.asarray(contact)[100:] == 1.0)
