"""A sweep makes every run once, goes on where a killed one stopped, and refuses what it cannot use
in one line.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from command_line import completed, started

from testbed.errors import InputError
from testbed.formats.files import owned
from testbed.formats.yaml_files import flattened
from testbed.report.sweep_page import page as sweep_page
from testbed.report.sweep_page import varied, worst
from testbed.scenario.sweep import FromOutside, Sweep, load_sweep, sweep_of
from testbed.simulation.sweep import (
    ALL,
    LOCKS,
    Share,
    SweepRun,
    merge_sweeps,
    run_sweep,
    summary_of,
    table,
)
from testbed.simulation.workers import Workers

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
    "latin": "latin: {samples: 2, ranges: {terrain.slope_deg: [3, 5]}}",
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


@pytest.mark.slow
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


def test_a_cluster_that_does_not_answer_leaves_no_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def silent(address: str) -> None:
        raise InputError("does not answer", field="--dask", value=address)

    monkeypatch.setattr("testbed.simulation.workers.cluster_client", silent)
    with pytest.raises(InputError, match="does not answer"):
        run_sweep(*load_sweep(_file(tmp_path, "")), tmp_path / "out", Workers(1, "tcp://nobody:1"))
    assert not (tmp_path / "out").exists()


def test_without_an_engine_a_sweep_leaves_no_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, "testbed.world.engine", raising=False)
    monkeypatch.setitem(sys.modules, "pybullet", None)
    with pytest.raises(InputError, match="PyBullet is not installed"):
        run_sweep(*load_sweep(_file(tmp_path, "")), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_run_that_another_process_is_at_is_left_alone(tmp_path: Path) -> None:
    sweep, runs = load_sweep(_file(tmp_path, ""))
    out = tmp_path / "out"
    with owned(out / LOCKS / runs[0].name):
        assert run_sweep(sweep, runs, out) == []
    assert not list((out / "runs").iterdir())


def test_two_shards_share_the_runs_out_and_parts_that_are_none_are_refused() -> None:
    assert Share.of("2/3") == Share(2, 3) and Share.of(None) == ALL
    runs = list(range(7))
    parts = [runs[s.number - 1 :: s.count] for s in (Share.of("1/2"), Share.of("2/2"))]
    assert sorted(parts[0] + parts[1]) == runs
    for text in ("0/2", "3/2", "1", "a/b", "1/0"):
        with pytest.raises(InputError, match="--shard"):
            Share.of(text)


def _done(folder: Path, name: str, error_n: float, verdict: str = "stood") -> None:
    """A run's folder as a finished run leaves it."""
    (folder / "runs" / name).mkdir(parents=True)
    summary = {"verdict": verdict, "interrupted": False, "force_rms_n": {"own": error_n}}
    (folder / "runs" / name / "summary.json").write_text(json.dumps(summary))


def test_merging_gathers_what_shards_made_and_makes_nothing(tmp_path: Path) -> None:
    _, runs = load_sweep(_file(tmp_path, "grid: {terrain.slope_deg: [0, 10, 20]}\n"))
    for folder, run, error_n in (("a", runs[0], 1.0), ("b", runs[2], 2.0)):
        _done(tmp_path / folder, run.name, error_n)
    results = merge_sweeps(runs, [tmp_path / "a", tmp_path / "b"], tmp_path / "all")
    assert [r["summary"]["force_rms_n"]["own"] for r in results] == [1.0, 2.0]
    again = merge_sweeps(runs, [tmp_path / "a"], tmp_path / "all")
    assert again == results
    with pytest.raises(InputError, match="--merge"):
        merge_sweeps(runs, [tmp_path / "nowhere"], tmp_path / "all")


def test_the_command_line_makes_grids_and_latin_hypercubes() -> None:
    _, runs = sweep_of(
        "stand_flat",
        [
            "terrain.slope_deg=10,20",
            "seed=1,2",
            "robot.payload_kg=0:400:4",
            "terrain.friction=0.4:0.8:4",
        ],
    )
    assert len(runs) == 2 * 2 * 4
    loads = sorted({run.scenario.robot.payload_kg for run in runs})
    assert [int(load // 100) for load in loads] == [0, 1, 2, 3]  # one sample in each quarter
    assert {run.scenario.seed for run in runs} == {1, 2}
    for wrong in ("terrain.slope_deg", "terrain.slope_deg=1:2:x:y", "terrain.slop_deg=1,2"):
        with pytest.raises(InputError):
            sweep_of("stand_flat", [wrong])
    with pytest.raises(InputError, match="4 samples, as before"):
        sweep_of("stand_flat", ["robot.payload_kg=0:400:4", "terrain.friction=0.4:0.8:5"])


def test_above_twenty_runs_only_summaries_are_kept_unless_the_file_says_so(tmp_path: Path) -> None:
    path = _file(tmp_path, "")
    path.write_text(path.read_text().replace("keep: summary\n", ""))
    plain = load_sweep(path)[0]
    assert plain.keeps_series(20) and not plain.keeps_series(21)
    path.write_text(path.read_text() + "keep: all\n")
    assert load_sweep(path)[0].keeps_series(21)


def test_the_page_shows_the_heat_and_the_worst_runs_first() -> None:
    results = [
        {"run": f"r{k}", "seed": 1, "changes": {"a.x": k % 2, "b": word}, "summary": summary}
        for k, (word, summary) in enumerate(
            [
                ("<b>", {"verdict": "stood", "force_rms_n": {"own": 10.0}}),
                ("<b>", {"verdict": "fell", "force_rms_n": {"own": 1.0}}),
                ("c", {"verdict": "stood", "force_rms_n": {"own": 30.0}}),
            ]
        )
    ]
    assert worst(results) == [1, 2, 0]
    assert varied(results) == ["a.x", "b"]
    text = sweep_page("Sweep <i>", results, 4)
    assert "3 of 4 runs are done; 2 of them stood" in text
    assert "<svg" in text and "<b>" not in text and "<i>" not in text


@pytest.mark.parametrize("count", [3, 40])
def test_the_page_shows_what_is_no_number_in_words(count: int) -> None:
    """Lists of events, and what some runs do not change, in a heat map or in points."""
    values = [[{"kind": "cut_rope", "at_s": k}] for k in range(count - 1)]
    changes: list[dict[str, Any]] = [{}, *({"events": value} for value in values)]
    results = [
        {"run": f"r{k}", "seed": 1, "changes": change, "summary": {"verdict": "stood"}}
        for k, change in enumerate(changes)
    ]
    assert "<svg" in sweep_page("Sweep", results, count)


def test_every_run_is_made_once_and_summed_up(tmp_path: Path) -> None:
    sweep, runs = load_sweep(_file(tmp_path, "grid: {terrain.slope_deg: [0, 30]}\n"))
    out = tmp_path / "out"
    first = run_sweep(sweep, runs[:1], out)
    made = (out / "runs" / runs[0].name / "summary.json").stat().st_mtime_ns
    both = run_sweep(sweep, runs, out)
    assert (out / "runs" / runs[0].name / "summary.json").stat().st_mtime_ns == made
    assert both[0] == first[0] and [e["changes"] for e in both] == [r.changes for r in runs]
    kept = {path.name for path in (out / "runs" / runs[0].name).iterdir()}
    assert not kept & {"truth.parquet", "data.parquet", "pictures"}  # keep: summary
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
    command = "sweep", path, "--out", out, "--jobs", "2"
    process = started(*command, start_new_session=True)
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
    again = completed(*command, timeout=300)
    assert again.returncode == 0, again.stderr
    assert {
        name: (out / "runs" / name / "summary.json").stat().st_mtime_ns for name in done
    } == before
    assert len((out / "results.csv").read_text().splitlines()) == 5


@pytest.mark.slow
def test_two_interrupts_at_once_end_a_sweep_that_keeps_what_is_done(tmp_path: Path) -> None:
    path = _file(tmp_path, "list: [{duration_s: 0.1}, {duration_s: 600}, {duration_s: 601}]\n")
    path.write_text(path.read_text().replace("duration_s: 0.1\nkeep", "keep"))
    short, *long = (r.name for r in load_sweep(path)[1])
    out = tmp_path / "out"
    command = "sweep", path, "--out", out, "--jobs", "2"
    process = started(*command, start_new_session=True)
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
        _, told = process.communicate(timeout=60)  # the pipes close once every process is gone
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
    assert process.returncode == 130, told
    assert f"testbed: interrupted; {out} holds what is done" in told
    assert {name for name in (short, *long) if summary_of(out / "runs" / name) is not None} == {
        short
    }
    assert [e["run"] for e in json.loads((out / "results.json").read_text())["runs"]] == [short]


def test_changes_from_outside_are_those_of_every_run(tmp_path: Path) -> None:
    """What the run command's options change of one scenario, they change of all runs here."""
    told = FromOutside(["terrain.friction=0.5", "robot.payload_kg=100"], 7, 2.5)
    path = _file(tmp_path, "set: {terrain.friction: 0.7}\ngrid: {terrain.slope_deg: [0, 10]}\n")
    for _, runs in (
        load_sweep(path, told),
        sweep_of("stand_flat", ["terrain.slope_deg=0,10"], told),
    ):
        assert [run.scenario.terrain.slope_deg for run in runs] == [0.0, 10.0]
        assert {
            (s.terrain.friction, s.robot.payload_kg, s.seed, s.duration_s)
            for s in (run.scenario for run in runs)
        } == {(0.5, 100.0, 7, 2.5)}


@pytest.mark.parametrize(
    ("told", "said"),
    [
        (FromOutside(["terrain.slope_deg=3"]), "set.terrain.slope_deg = 3.*grid or here"),
        (FromOutside(["terrain.friction"]), "is not an assignment"),
        (FromOutside(["seed=3"]), "set.seed = 3.*seeds"),
        (FromOutside(seed=3), "seeds here or --seed"),
    ],
)
def test_changes_that_would_do_nothing_are_refused(told: FromOutside, said: str) -> None:
    with pytest.raises(InputError, match=said):
        sweep_of("stand_flat", ["terrain.slope_deg=0,10", "seed=1,2"], told)
