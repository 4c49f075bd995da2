"""On a full disk a run says which file could not be written, and what it had recorded stays whole
and readable.
"""

from __future__ import annotations

import errno
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from command_line import completed

from testbed.errors import InputError
from testbed.scenario.scenario import load_scenario
from testbed.simulation.recorder import Joined, RunRecorder, size_bytes
from testbed.simulation.run import run_scenario
from testbed.simulation.runs import read_run
from testbed.simulation.sweep import summary_of
from testbed.workflows.report import write_report

FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _full(*_: Any, **__: Any) -> None:
    raise FULL


@pytest.mark.slow
def test_the_size_that_is_asked_for_is_about_the_size_that_is_taken(tmp_path: Path) -> None:
    folder = run_scenario(load_scenario("drill_slope_45", duration=3.0), tmp_path / "run").folder
    files = [folder / f"{name}.parquet" for name in ("data", "truth")]
    taken = sum(file.stat().st_size for file in files)
    columns = [pq.read_schema(file).names for file in files]
    assert 0.7 * taken < size_bytes(3000, columns) < 1.5 * taken


def test_a_run_that_will_not_fit_is_refused_before_it_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Usage:
        free = 100_000

    monkeypatch.setattr("shutil.disk_usage", lambda _: Usage)
    with pytest.raises(InputError, match=r"run: --out: has 0\.1 MB free, and about"):
        run_scenario(load_scenario("stand_flat", duration=10.0), tmp_path / "run")
    assert list((tmp_path / "run").iterdir()) == []


@pytest.mark.slow
def test_parts_that_cannot_be_joined_stay_and_the_run_is_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Joined, "_write", _full)
    with pytest.raises(InputError, match=r"data\.parquet: its parts are whole.*No space left"):
        run_scenario(load_scenario("stand_flat", duration=1.5), tmp_path / "run")
    run = read_run(tmp_path / "run")
    assert np.array_equal(run.data["t"], run.truth["t"]) and len(run.time_s) == 1500
    assert summary_of(tmp_path / "run") is not None  # a whole run: a sweep need not make it again
    assert write_report(tmp_path / "run").is_file()


@pytest.mark.slow
def test_a_disk_that_fills_up_meanwhile_ends_the_run_and_keeps_what_was_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = RunRecorder._write_part

    def until_full(self: RunRecorder, name: str, number: int, block: Any) -> None:
        if number == 2:
            raise InputError("cannot be written: No space left", file=f"part-{number}")
        write(self, name, number, block)

    monkeypatch.setattr(RunRecorder, "_write_part", until_full)
    with pytest.raises(InputError, match="part-2: cannot be written: No space left"):
        run_scenario(load_scenario("stand_flat", duration=6.0), tmp_path / "run")
    run = read_run(tmp_path / "run")
    assert run.time_s[-1] == pytest.approx(2.0) and run.summary is not None
    assert run.summary["verdict"].startswith("fault") and summary_of(tmp_path / "run") is None


def test_rows_that_are_lost_after_the_last_step_are_a_fault_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The recorder may lag behind the run by all of it."""

    close = RunRecorder.close

    def full(self: RunRecorder) -> None:
        close(self)
        raise InputError("cannot be written: No space left", file="part-2")

    monkeypatch.setattr(RunRecorder, "close", full)
    with pytest.raises(InputError, match="No space left"):
        run_scenario(load_scenario("stand_flat", duration=1.0), tmp_path / "run")
    summary = read_run(tmp_path / "run").summary
    assert summary is not None and summary["verdict"].startswith("fault")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of one and a half megabytes; only the machine's owner may make one."""
    place = tmp_path / "disk"
    place.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=1500k", "tmpfs", str(place)]
    if os.geteuid() != 0 or subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("no file system can be mounted here")
    yield place
    subprocess.run(["umount", str(place)], check=True)


@pytest.mark.slow
def test_a_disk_that_is_really_full(small_disk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    refused = completed("run", "stand_flat", "--out", small_disk / "a", "--duration", "60")
    assert refused.returncode == 2 and "MB free" in refused.stderr
    monkeypatch.setattr("testbed.simulation.run_folder.check_space", lambda *_: None)
    with pytest.raises(InputError, match="No space left on device"):
        run_scenario(load_scenario("stand_flat", duration=60.0), small_disk / "a")
    run = read_run(small_disk / "a")
    assert len(run.time_s) >= 500
    assert np.isfinite(np.concatenate([*run.data.values(), *run.truth.values()])).all()
