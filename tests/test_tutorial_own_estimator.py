"""The tutorial of one's own estimator does what it says: its code is taken out and run."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pyarrow.csv as csv
import pytest
from typer.testing import CliRunner

from testbed.cli import app
from testbed.simulation.runs import read_series

PAGE = (Path(__file__).parents[1] / "docs" / "tutorials" / "own_estimator.md").read_text()


def _blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}[^\n]*\n(.*?)```", PAGE, re.DOTALL)


def test_an_estimator_in_and_the_same_loads_live_and_over_the_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert PAGE.count("\n") <= 60
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(_blocks("python")[0])
    for command in _blocks("sh"):
        done = CliRunner().invoke(app, shlex.split(command)[1:])
        assert done.exit_code == 0, done.output
    live = read_series(tmp_path / "run", "data")
    over = csv.read_csv(tmp_path / "forces.csv")
    for leg in ("fl", "fr", "rl", "rr"):
        load = np.asarray(live[f"estimate_own_{leg}"])
        assert np.ptp(load) > 1.0
        np.testing.assert_allclose(over[f"force_{leg}_n"].to_numpy(), load, atol=1e-3)
        low = np.asarray(live[f"own_low_{leg}"])
        np.testing.assert_allclose(over[f"force_{leg}_n_low"].to_numpy(), low, atol=1e-3)
        np.testing.assert_allclose(load - low, 1000.0, atol=1e-2)
