"""A sweep makes every run once, goes on where a killed one stopped, and refuses what it cannot use in one line."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from testbed.errors import InputError
from testbed.formats.ownership import owned
from testbed.formats.tree import flattened
from testbed.scenario.sweep import Sweep, load_sweep
from testbed.simulation.sweep import SweepRun, run_sweep, summary_of, table

HEAD = "format: roboclimber-sweep/1\nscenario: stand_flat\nduration_s: 0.1\nkeep: summary\n"


def _file(folder: Path, body: str) -> Path:
    path = folder / "sweep.yaml"
    path.write_text(HEAD + body)
    return path


def test_runs_are_list_times_grid_times_seeds(tmp_path: Path) -> None:
    body = (
        "seeds: [1, 2]\nset: {terrain.friction: 0.5}\ngrid: {terrain.slope_deg: [0, 10, 20]}\n"
        "list: [{robot.payload_kg: 0}, {robot.payload_kg: 50}]\n"
    )
    _, runs = load_sweep(_file(tmp_path, body))
    assert len(runs) == 2 * 3 * 2 == len({run.name for run in runs})
    assert {r.scenario.terrain.friction for r in runs} == {0.5}
    wanted = {(slope, load, seed) for slope in (0, 10, 20) for load in (0, 50) for seed in (1, 2)}
    assert {
        (r.scenario.terrain.slope_deg, r.scenario.robot.payload_kg, r.scenario.seed) for r in runs
    } == wanted


def test_a_duration_in_the_grid_is_that_of_the_run(tmp_path: Path) -> None:
    path = _file(tmp_path, "grid: {duration_s: [0.2, 0.3]}\n")
    path.write_text(path.read_text().replace("duration_s: 0.1\n", ""))
    assert [(r.changes["duration_s"], r.scenario.duration_s) for r in load_sweep(path)[1]] == [
        (0.2, 0.2),
        (0.3, 0.3),
    ]


def test_a_folder_is_called_after_changes_and_seed_and_marks_the_whole_scenario(
    tmp_path: Path,
) -> None:
    (run,) = load_sweep(_file(tmp_path, "grid: {terrain.slope_deg: [10]}\n"))[1]
    longer = SweepRun(run.changes, run.scenario.model_copy(update={"duration_s": 0.2}))
    assert run.name.startswith("slope_deg-10_seed-1_")
    assert longer.name.startswith("slope_deg-10_seed-1_") and longer.name != run.name


OTHER = {
    "scenario": "scenario: stand_slope_45",
    "duration_s": "duration_s: 0.2",
    "seeds": "seeds: [1, 2]",
    "set": "set: {terrain.slope_deg: 5}",
    "grid": "grid: {terrain.slope_deg: [5]}",
    "list": "list: [{terrain.slope_deg: 5}]",
}
ELSEWHERE = {
    "format": "has one value, another is refused",
    "description": "tells people what the sweep is for",
    "keep": "decides which files stay; test_every_run_is_made_once_and_summed_up",
}


def test_every_field_of_a_sweep_changes_its_runs(tmp_path: Path) -> None:
    assert {*OTHER, *ELSEWHERE} == set(Sweep.model_fields)
    plain = [run.scenario for run in load_sweep(_file(tmp_path, ""))[1]]
    for field, text in OTHER.items():
        path = _file(tmp_path, "")
        kept = [line for line in path.read_text().splitlines() if not line.startswith(f"{field}:")]
        path.write_text("\n".join([*kept, text, ""]))
        assert [run.scenario for run in load_sweep(path)[1]] != plain, field


def test_the_shipped_sweep_loads() -> None:
    assert len(load_sweep("slopes_and_payloads")[1]) == 24


@pytest.mark.parametrize(
    ("body", "told"),
    {
        "grid: {terrain.slop_deg: [1]}": "terrain.slop_deg: unknown key, did you mean 'slope_deg'",
        "grid: {terrain.slope_deg: [10, 95]}": "slope_deg=95, seed 1",
        "grid: {terrain.slope_deg: 10}": "grid.terrain.slope_deg = 10: cannot be used (allowed: a list of values)",
        "grid: {terrain.slope_deg: []}": "grid.terrain.slope_deg = []",
        "seeds: []": "seeds = []",
        "seeds: 3": "seeds = 3",
        "lists: [{}]": "lists: unknown key, did you mean 'list'",
        "grid: {seed: [7, 8]}": "grid.seed = (7, 8): would have no effect (allowed: seeds: the seeds of every run)",
        "set: {seed: 5}": "set.seed = 5",
        "list: [{}, {seed: 5}]": "list.1.seed = 5",
        "set: {duration_s: 2}": "set.duration_s = 2: would have no effect (allowed: duration_s in one place",
        "set: {terrain.friction: 0.5}\ngrid: {terrain.friction: [0.6]}": "set.terrain.friction = 0.5: would have no effect",
        "set: {terrain.friction: 0.5}\nlist: [{terrain.friction: 0.6}]": "set.terrain.friction = 0.5: would have no effect",
        "list: [{terrain.friction: 0.5}]\ngrid: {terrain.friction: [0.6]}": "list.0.terrain.friction = 0.5: would have no effect",
        "keep: some": "key 'keep' is given twice",
        "grid: {terrain.friction: ["
        + ", ".join(f"0.{i:06d}" for i in range(100_001))
        + "]}": "too many runs",
    }.items(),
    ids=lambda value: value[:30],
)
def test_what_cannot_be_used_is_one_line_and_nothing_is_written(
    tmp_path: Path, body: str, told: str
) -> None:
    with pytest.raises(InputError, match="sweep") as error:
        load_sweep(_file(tmp_path, body + "\n"))
    assert told in str(error.value) and "\n" not in str(error.value)
    assert [p.name for p in tmp_path.iterdir()] == ["sweep.yaml"]


def test_a_folder_of_something_else_is_refused(tmp_path: Path) -> None:
    sweep, runs = load_sweep(_file(tmp_path, ""))
    with pytest.raises(InputError, match="files of something else"):
        run_sweep(sweep, runs, tmp_path)


def test_two_sweeps_do_not_share_a_folder(tmp_path: Path) -> None:
    sweep, runs = load_sweep(_file(tmp_path, ""))
    with owned(tmp_path / "out"), pytest.raises(InputError, match="another testbed process"):
        run_sweep(sweep, runs, tmp_path / "out")
    assert not list((tmp_path / "out").iterdir())


def test_every_run_is_made_once_and_summed_up(tmp_path: Path) -> None:
    sweep, runs = load_sweep(_file(tmp_path, "grid: {terrain.slope_deg: [0, 30]}\n"))
    out = tmp_path / "out"
    first = run_sweep(sweep, runs[:1], out)
    made = (out / "runs" / runs[0].name / "summary.json").stat().st_mtime_ns
    both = run_sweep(sweep, runs, out)
    assert (out / "runs" / runs[0].name / "summary.json").stat().st_mtime_ns == made
    assert both[0] == first[0] and [e["changes"] for e in both] == [r.changes for r in runs]
    assert not (out / "runs" / runs[0].name / "truth.parquet").exists()  # keep: summary
    lines = (out / "results.csv").read_text().splitlines()
    assert (
        len(lines) == 3
        and lines[0].startswith("run,seed,terrain.slope_deg,")
        and "force_rms_n.own" in lines[0]
    )
    assert [e["run"] for e in json.loads((out / "results.json").read_text())["runs"]] == [
        r.name for r in runs
    ]
    heads, rows = table(both)
    assert heads[:2] == ["slope_deg", "seed"] and rows[1][:2] == ["30", "1"]


def test_an_interrupted_or_half_written_run_is_not_done(tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text('{"interrupted": true}')
    assert summary_of(tmp_path) is None
    (tmp_path / "summary.json").write_text('{"interrupted": fal')
    assert summary_of(tmp_path) is None
    (tmp_path / "summary.json").write_text('{"interrupted": false}')
    assert summary_of(tmp_path) == {"interrupted": False}


def test_leaves_of_nested_mappings_get_dotted_paths() -> None:
    tree = {"a": {"b": 1, "c": {"d": "x"}}, "e": [1, 2], "f": None}
    assert flattened(tree) == [("a.b", 1), ("a.c.d", "x"), ("f", None)]


@pytest.mark.slow
@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGINT])
def test_a_stopped_sweep_goes_on_where_it_was(tmp_path: Path, blow: signal.Signals) -> None:
    path = _file(tmp_path, "seeds: [1, 2, 3, 4]\n")
    path.write_text(path.read_text().replace("0.1", "3"))
    out = tmp_path / "out"
    command = [
        sys.executable,
        "-m",
        "testbed",
        "sweep",
        str(path),
        "--out",
        str(out),
        "--jobs",
        "2",
    ]
    process = subprocess.Popen(
        command, start_new_session=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    deadline = time.monotonic() + 120
    while not list(out.glob("runs/*/summary.json")) and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(process.pid, blow)
    process.communicate(timeout=60)
    assert process.returncode == (130 if blow == signal.SIGINT else -9)
    runs = load_sweep(path)[1]
    done = {r.name for r in runs if summary_of(out / "runs" / r.name) is not None}
    assert 1 <= len(done) < 4
    before = {name: (out / "runs" / name / "summary.json").stat().st_mtime_ns for name in done}
    again = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert again.returncode == 0, again.stderr
    assert {
        name: (out / "runs" / name / "summary.json").stat().st_mtime_ns for name in done
    } == before
    assert len((out / "results.csv").read_text().splitlines()) == 5


@pytest.mark.slow
def test_a_second_interrupt_ends_the_processes_and_keeps_what_is_done(tmp_path: Path) -> None:
    path = _file(tmp_path, "list: [{duration_s: 0.1}, {duration_s: 600}, {duration_s: 601}]\n")
    path.write_text(path.read_text().replace("duration_s: 0.1\nkeep", "keep"))
    short, *long = (r.name for r in load_sweep(path)[1])
    out = tmp_path / "out"
    command = [
        sys.executable,
        "-m",
        "testbed",
        "sweep",
        str(path),
        "--out",
        str(out),
        "--jobs",
        "2",
    ]
    process = subprocess.Popen(
        command, start_new_session=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    try:
        deadline = time.monotonic() + 120
        for name in long:
            while (
                not list(out.glob(f"runs/{name}/data.parquet/*.parquet"))
                and time.monotonic() < deadline
            ):
                time.sleep(0.05)
        for _ in range(2):
            os.killpg(process.pid, signal.SIGINT)
            time.sleep(0.05)
        _, told = process.communicate(timeout=60)  # the pipes close once every process is gone
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
    assert process.returncode == 130, told.decode()
    assert {name for name in (short, *long) if summary_of(out / "runs" / name) is not None} == {
        short
    }
    assert [e["run"] for e in json.loads((out / "results.json").read_text())["runs"]] == [short]
