"""A run on disk: what is handed over comes back, also after a kill."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from testbed.errors import InputError
from testbed.scenario.scenario import load_scenario
from testbed.simulation.live_run import simulate
from testbed.simulation.outputs import check_out, claimed
from testbed.simulation.recorder import RunRecorder
from testbed.simulation.runs import open_run, read_run
from testbed.workflows.report import write_report

META = {"format": "roboclimber-recording/1", "rig": "robot", "data": "data.parquet"}


def _blocks(recorder: RunRecorder, blocks: int, rows: int = 1000, columns: int = 3) -> None:
    for k in range(blocks):
        t = (np.arange(rows) + k * rows) / 1000.0
        recorder.write(
            np.column_stack([t, *[np.sin(t + i) for i in range(columns - 1)]]),
            np.column_stack([t, 1e4 * t]),
        )


def test_rows_come_back_in_order_and_time_keeps_all_its_bits(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path / "run", ["t", "a", "b"], ["t", "load"], META)
    _blocks(recorder, 7)
    recorder.finish({"verdict": "stood", "nan": float("nan"), "n": np.int64(3)})
    run = read_run(tmp_path / "run")
    assert np.array_equal(run.data["t"], np.arange(7000) / 1000.0)
    assert np.array_equal(run.data["a"], np.sin(run.data["t"]).astype(np.float32))
    assert run.truth["load"][-1] == pytest.approx(69990.0, abs=4e-3)
    assert run.summary == {"verdict": "stood", "nan": None, "n": 3}
    assert sorted(p.name for p in (tmp_path / "run").iterdir()) == [
        "data.parquet",
        "recording.yaml",
        "summary.json",
        "truth.parquet",
    ]
    assert (tmp_path / "run/data.parquet").is_file()


def test_only_the_columns_asked_for_are_read(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, ["t", "a", "b"], ["t", "load"], META)
    _blocks(recorder, 1)
    recorder.finish()
    run = read_run(tmp_path, ["b", "load", "absent"])
    assert list(run.data) == ["t", "b"]
    assert list(run.truth) == ["t", "load"]


@pytest.mark.parametrize("ended", [True, False])
def test_an_opened_run_holds_what_a_read_one_does(tmp_path: Path, ended: bool) -> None:
    """Up to the last row that both series have: a full disk may have cost one of them its last."""
    recorder = RunRecorder(tmp_path, ["t", "a", "b"], ["t", "load"], META)
    _blocks(recorder, 3, rows=100)
    recorder.write(np.array([[0.3, 1.0, 2.0]]), np.empty((0, 2)))
    (recorder.finish if ended else recorder.close)()
    opened, whole = open_run(tmp_path), read_run(tmp_path)
    for one, other in ((opened.data, whole.data), (opened.truth, whole.truth)):
        assert list(one) == list(other) and "absent" not in one and one.get("absent") is None
        assert all(np.array_equal(one[name], other[name]) for name in other)
    assert len(opened.time_s) == 300


def test_equal_blocks_give_equal_bytes(tmp_path: Path) -> None:
    for name in ("one", "two"):
        recorder = RunRecorder(tmp_path / name, ["t", "a", "b"], ["t", "load"], META)
        _blocks(recorder, 3)
        recorder.finish()
    assert (tmp_path / "one/data.parquet").read_bytes() == (
        tmp_path / "two/data.parquet"
    ).read_bytes()


def test_a_file_is_the_same_however_its_parts_were_cut(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("testbed.simulation.recorder._ROWS_PER_GROUP", 700)
    for rows in (100, 350, 1050, 2100):
        recorder = RunRecorder(tmp_path / str(rows), ["t", "a", "b"], ["t", "load"], META)
        _blocks(recorder, 2100 // rows, rows)
        recorder.finish()
    files = [tmp_path / name / "data.parquet" for name in ("100", "350", "1050", "2100")]
    assert len({file.read_bytes() for file in files}) == 1
    assert pq.ParquetFile(files[0]).num_row_groups == 3


def test_rows_that_wait_for_their_group_lie_in_a_few_pieces(tmp_path: Path) -> None:
    """A slow recording hands over few rows at a time, for hours until a group is full."""
    recorder = RunRecorder(tmp_path, ["t", "a", "b"], ["t", "load"], META)
    _blocks(recorder, 300, 2)
    recorder.close()
    waiting = recorder._joined["data"]._waiting
    assert len(waiting) == 600
    assert waiting.column("a").num_chunks <= 17
    assert (
        waiting.column("a").to_pylist() == pq.read_table(tmp_path / "data.parquet")["a"].to_pylist()
    )


@pytest.mark.slow
def test_sparse_rows_are_gathered_for_some_seconds_and_no_longer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At one row a second, parts of one row would be a hundred times larger than what they hold."""
    write, written = RunRecorder.write, list[int]()

    def counted(self: RunRecorder, data: Any, truth: Any) -> None:
        written.append(len(data))
        write(self, data, truth)

    monkeypatch.setattr(RunRecorder, "write", counted)
    for longest_s, parts in ((1000.0, [10]), (-1.0, [1] * 10)):
        monkeypatch.setattr("testbed.simulation.run_folder.LONGEST_WAIT_S", longest_s)
        written.clear()
        loaded = load_scenario("stand_flat", ["rates.record_hz=10"], duration=1.0)
        with simulate(loaded, out=tmp_path / f"run{longest_s}") as run:
            while not run.finished:
                run.step(100)
        assert [rows for rows in written if rows] == parts


def test_a_running_record_is_readable_as_a_folder_of_parts(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, ["t", "a", "b"], ["t", "load"], META)
    _blocks(recorder, 2)
    recorder.close()
    assert len(pq.read_table(tmp_path / "data.parquet")) == 2000
    assert read_run(tmp_path).summary is None


CHILD = """
import sys, time, numpy as np
from testbed.simulation.recorder import RunRecorder
r = RunRecorder(sys.argv[1], ["t", "a"], ["t", "b"], {"format": "roboclimber-recording/1", "rig": "robot"})
for k in range(10000):
    t = (np.arange(1000) + 1000 * k) / 1000.0
    r.write(np.column_stack([t, t]), np.column_stack([t, 2 * t]))
    print(k, flush=True)
    time.sleep(0.02)
"""


@pytest.mark.slow
def test_a_killed_run_is_readable_up_to_its_last_second(tmp_path: Path) -> None:
    child = subprocess.Popen(
        [sys.executable, "-c", CHILD, str(tmp_path / "run")], stdout=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    for line in child.stdout:
        if int(line) >= 20:
            break
    child.send_signal(signal.SIGKILL)
    child.wait()
    run = read_run(tmp_path / "run")
    assert run.data["t"][-1] >= 19.0  # at most the block being written is lost
    assert np.array_equal(run.data["t"], np.arange(len(run.data["t"])) / 1000.0)
    assert np.allclose(run.truth["b"], 2 * run.truth["t"])


def test_handing_over_a_second_costs_under_three_milliseconds(tmp_path: Path) -> None:
    names = ["t", *[f"c{i}" for i in range(119)]]
    recorder = RunRecorder(tmp_path, names, names, META)
    block = np.random.default_rng(0).normal(size=(1000, 120))
    costs = []
    for _ in range(10):
        start = time.perf_counter()
        recorder.write(block, block)
        costs.append(time.perf_counter() - start)
        time.sleep(0.05)
    recorder.close()
    assert np.quantile(costs, 0.25) < 3e-3  # the others may have waited for a processor


def test_a_folder_that_goes_away_is_reported_in_one_line(tmp_path: Path) -> None:
    import shutil

    recorder = RunRecorder(tmp_path / "run", ["t", "a", "b"], ["t", "load"], META)
    shutil.rmtree(tmp_path / "run")
    with pytest.raises(InputError, match="cannot be written"):
        _blocks(recorder, 1)
        recorder.finish()


def test_default_folders_are_numbered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    made = []
    for _ in range(3):
        with claimed(None, "stand", 3) as folder:
            made.append(str(folder))
    assert made == ["runs/stand-3", "runs/stand-3-2", "runs/stand-3-3"]


def test_a_foreign_folder_is_refused_and_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(InputError, match=r"thesis\.tex"), claimed(tmp_path, "stand", 0):
        raise AssertionError("a foreign folder was claimed")
    assert os.listdir(tmp_path) == ["thesis.tex"]


def test_a_measured_recording_is_no_run_and_left_alone(tmp_path: Path) -> None:
    """As `testbed import` leaves one: its two files have the names of a run's."""
    for name in ("recording.yaml", "data.parquet"):
        (tmp_path / name).write_text("measured")
    with (
        pytest.raises(InputError, match="a recording that no run has made"),
        claimed(tmp_path, "stand", 0),
    ):
        raise AssertionError("a measured recording was claimed")
    assert sorted(os.listdir(tmp_path)) == ["data.parquet", "recording.yaml"]


def test_an_earlier_run_is_written_over(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, ["t", "a", "b"], ["t", "load"], META)
    _blocks(recorder, 2)
    recorder.finish({"verdict": "stood"})
    with claimed(tmp_path, "stand", 0) as folder:
        assert folder == tmp_path and list(tmp_path.iterdir()) == []


def test_a_run_that_is_being_written_is_not_written_over_nor_reported(tmp_path: Path) -> None:
    with claimed(tmp_path, "stand", 0):
        recorder = RunRecorder(tmp_path, ["t", "a", "b"], ["t", "load"], META)
        _blocks(recorder, 2)
        recorder.close()
        before = sorted(tmp_path.rglob("*"))
        with pytest.raises(InputError, match="another testbed process"):
            write_report(tmp_path)
        with (
            pytest.raises(InputError, match="another testbed process"),
            claimed(tmp_path, "stand", 1),
        ):
            raise AssertionError("two runs in one folder")
        assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("out", ["file", "file/below"])
def test_a_file_in_the_way_is_refused(tmp_path: Path, out: str) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="--out"):
        check_out(tmp_path / out)
