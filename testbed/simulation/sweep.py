"""Many runs of one sweep file, each in its own folder, resumable, summed up in one table."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from testbed.errors import InputError, SimulationFault
from testbed.formats.files import (
    OccupiedError,
    make_folder,
    owned,
    resumable,
    write_json,
    write_text,
)
from testbed.formats.yaml_files import flattened
from testbed.scenario.scenario import Scenario
from testbed.scenario.sweep import Sweep, SweepRun
from testbed.simulation.run import Recording, run_scenario
from testbed.simulation.run_folder import spelt
from testbed.simulation.run_summary import MADE_BY
from testbed.simulation.workers import HERE, Workers, work_through

Progress = Callable[[int], None]
RESULTS = ("results.csv", "results.json")
LOCKS = ".locks"
"""Folders that stand for runs while they are made; empty."""
BULK = ("data.parquet", "truth.parquet", "pictures")
SHOWN = {
    "verdict": "verdict",
    "force_rms_n.own": "own force error [N]",
    "detector.losses": "losses",
    "detector.missed": "missed",
    "detector.false_alarms": "false alarms",
    "lowest_stability_margin": "lowest margin",
}
"""Columns of the summary that the console shows."""


@dataclass(frozen=True)
class Job:
    """One run, where it goes, and where its lock is."""

    run: SweepRun
    folder: Path
    lock: Path
    keeps_series: bool


@dataclass(frozen=True)
class Share:
    """Part `number` of `count` of a sweep: every so-manieth of its runs."""

    number: int = 1
    count: int = 1

    @classmethod
    def of(cls, text: str | None) -> Share:
        """`2/4` is the second of four. Raises InputError."""
        number, slash, count = (text or "1/1").partition("/")
        if not (slash and number.isdigit() and count.isdigit() and 1 <= int(number) <= int(count)):
            allowed = "i/n with i from 1 to n, such as 2/4"
            raise InputError("is no part", field="--shard", value=text, allowed=allowed)
        return cls(int(number), int(count))


ALL = Share()


def run_sweep(
    sweep: Sweep,
    runs: Sequence[SweepRun],
    out: Path,
    workers: Workers = HERE,
    share: Share = ALL,
    progress: Progress | None = None,
) -> list[dict[str, Any]]:
    """Make the runs of this share that `out/runs` lacks, write results.csv and results.json of all
    that are done.

    Returns those results in order. A run counts as made once its summary says that it was not
    interrupted; what a killed process left is made again. Several processes may work in one `out`:
    each run has its lock, and is made once. After Ctrl-C the runs at work keep what they have,
    results hold those that are done, and KeyboardInterrupt goes on. Raises InputError where `out`
    cannot be used, a cluster does not answer or there is no engine here.
    """
    check_sweep_folder(out)
    workers.check()
    if not workers.cluster:
        import_module(
            "testbed.world.engine"
        )  # refused where there is none, before a folder is made
    folder = make_folder(out / "runs").resolve()
    keeps = sweep.keeps_series(len(runs))
    todo = [
        Job(run, folder / run.name, folder.parent / LOCKS / run.name, keeps)
        for run in runs[share.number - 1 :: share.count]
        if summary_of(folder / run.name) is None
    ]
    done = len(runs[share.number - 1 :: share.count]) - len(todo)
    with resumable(out):
        try:
            if progress is not None:
                progress(done)
            for _ in work_through(make_run, todo, workers, bool):
                done += 1
                if progress is not None:
                    progress(done)
        finally:
            results = collect(runs, folder)
            write_results(results, out)
    return results


def check_sweep_folder(out: Path) -> None:
    """Refuse a folder that holds something else than a sweep. Raises InputError."""
    if out.is_dir():
        own = (*RESULTS, "runs", LOCKS.removeprefix("."), "sweep.html")
        foreign = sorted(p.name for p in out.iterdir() if p.name.removeprefix(".") not in own)
        if foreign:
            raise InputError(
                f"holds files of something else ({foreign[0]})",
                file=out,
                field="--out",
                allowed="a new or empty folder, or an earlier sweep",
            )


def make_run(job: Job) -> bool:
    """Make one run in its folder; returns whether it was interrupted. A simulation that broke down
    is a result too.

    A run that another process is at, or has made meanwhile, is left alone.
    """
    try:
        with owned(job.lock):
            if summary_of(job.folder) is not None:
                return False
            interrupted = run_scenario(
                job.run.scenario, job.folder, recording=Recording(job.keeps_series)
            ).interrupted
    except (SimulationFault, OccupiedError):
        return False
    if not job.keeps_series and not interrupted:
        _remove_bulk(job.folder)
    return interrupted


def merge_sweeps(
    runs: Sequence[SweepRun], folders: Sequence[Path], out: Path
) -> list[dict[str, Any]]:
    """Copy finished runs from the folders of other sweeps into `out`, and write the results of all
    that are done.

    A run that `out` has already stays as it is. Raises InputError where a folder holds no sweep.
    """
    import shutil

    check_sweep_folder(out)
    into = make_folder(out / "runs")
    for folder in folders:
        if not (folder / "runs").is_dir():
            raise InputError(
                "holds no sweep", file=folder, field="--merge", allowed="a folder with runs/"
            )
    for run in runs:
        sources = [f / "runs" / run.name for f in folders if summary_of(f / "runs" / run.name)]
        if sources and summary_of(into / run.name) is None:
            shutil.copytree(sources[0], into / run.name, dirs_exist_ok=True)
    results = collect(runs, into)
    write_results(results, out)
    return results


def _remove_bulk(folder: Path) -> None:
    import shutil

    for name in BULK:
        path = folder / name
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


def summary_of(folder: Path) -> dict[str, Any] | None:
    """The summary of a run that is done, else None."""
    try:
        found = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) and not found.get("interrupted", True) else None


def holds_run(folder: Path, scenario: Scenario) -> bool:
    """Whether a folder holds all of the run of this very scenario, every value the same, as this
    version makes it.
    """
    kept, summary = folder / "scenario.yaml", summary_of(folder)
    same = kept.is_file() and kept.read_bytes() == spelt(scenario).encode()
    return same and summary is not None and summary.get("made_by") == MADE_BY


def collect(runs: Sequence[SweepRun], folder: Path) -> list[dict[str, Any]]:
    """One entry for each run that is done: its folder's name, seed, changes and summary."""
    found = [(run, summary_of(folder / run.name)) for run in runs]
    return [
        {"run": run.name, "seed": run.scenario.seed, "changes": run.changes, "summary": summary}
        for run, summary in found
        if summary is not None
    ]


def write_results(results: Sequence[Mapping[str, Any]], out: Path) -> None:
    """Write out/results.json and out/results.csv, whole or not at all."""
    tree = {"format": "roboclimber-sweep-results/1", "runs": list(results)}
    write_json(out / "results.json", tree)
    flat = [_row(entry) for entry in results]
    heads = list(dict.fromkeys(head for row in flat for head in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, heads, lineterminator="\n")
    writer.writeheader()
    writer.writerows(flat)
    write_text(out / "results.csv", text.getvalue())


def _row(entry: Mapping[str, Any]) -> dict[str, Any]:
    """One line of the CSV: changes and every single number or word of the summary under its dotted
    path.
    """
    row = {"run": entry["run"], "seed": entry["seed"], **entry["changes"]}
    for path, value in flattened(entry["summary"]):
        row.setdefault(path, value)
    return row


def table(results: Sequence[Mapping[str, Any]]) -> tuple[list[str], list[list[str]]]:
    """Head and rows of the table that a person wants to see."""
    paths = list(dict.fromkeys(path for entry in results for path in entry["changes"]))
    heads = [*(path.rpartition(".")[2] for path in paths), "seed", *SHOWN.values()]
    rows = []
    for entry in results:
        values = dict(flattened(entry["summary"]))
        changed = [_word(entry["changes"].get(path)) for path in paths]
        rows.append([*changed, str(entry["seed"]), *(_word(values.get(path)) for path in SHOWN)])
    return heads, rows


def _word(value: Any) -> str:
    return "" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)
