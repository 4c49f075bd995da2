"""Speed of the whole command: its times, and a run that leaves no report."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest

from testbed.benchmarks.speed import whole_runs
from testbed.benchmarks.speed.whole_runs import ALLOWED_S, command_speeds, command_table
from testbed.errors import InputError


class _Bare:
    steps = 0

    def step(self) -> None:
        self.steps += 1

    def close(self) -> None:
        pass


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch) -> _Bare:
    engine = _Bare()
    monkeypatch.setattr(whole_runs, "bare_engine", lambda _: engine)
    return engine


def _stands_for_testbed(monkeypatch: pytest.MonkeyPatch, reports: bool) -> None:
    def run(words: list[str], **_: Any) -> subprocess.CompletedProcess[str]:
        out = Path(words[words.index("--out") + 1])
        out.mkdir()
        if reports:
            (out / "report.html").write_text("a page")
        return subprocess.CompletedProcess(words, 0, "", "broke")

    monkeypatch.setattr(whole_runs.subprocess, "run", run)


def test_the_bare_engine_takes_as_many_steps_as_the_run(
    bare: _Bare, monkeypatch: pytest.MonkeyPatch
) -> None:
    _stands_for_testbed(monkeypatch, True)
    (found,) = command_speeds(["stand_flat"])
    assert bare.steps == 20_000 and found["simulated_s"] == 20.0
    assert found["beyond_s"] == found["command_s"] - found["bare_s"]
    assert found["allowed_s"] == ALLOWED_S
    assert command_table([found]).rows[0][0] == "stand_flat"


def test_a_command_without_a_report_is_no_measurement(
    bare: _Bare, monkeypatch: pytest.MonkeyPatch
) -> None:
    _stands_for_testbed(monkeypatch, False)
    with pytest.raises(InputError, match="leaves no report: broke"):
        command_speeds(["stand_flat"])
