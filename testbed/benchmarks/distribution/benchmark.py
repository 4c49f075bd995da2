"""The force-distributing controllers on identical held-out cases, against an oracle that knows the truth.

Every finished case is a file of its own: a benchmark that was stopped goes on where it was, and one that is asked for
another controller runs that one only. Runs of other source code are not taken over.
"""

from __future__ import annotations

import csv
import hashlib
import inspect
import io
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.distribution.cases import Case, Outcome, draw_cases
from testbed.benchmarks.distribution.compare import BASE, against_base
from testbed.benchmarks.distribution.run import ORACLE, run_case
from testbed.control.distribution.controllers import CONTROLLERS, controller
from testbed.control.distribution.quadratic import Quadratic
from testbed.errors import InputError
from testbed.formats.files import make_folder, write_json, write_text
from testbed.simulation.workers import work_through

Array = NDArray[np.float64]
ROOMS = ("formats", "machine", "scenario", "laws", "effects", "robot", "estimation", "world")
"""Rooms whose sources decide what any run gives; of control, what no single controller owns."""
PACKAGE = Path(__file__).resolve().parents[2]


@lru_cache(maxsize=1)
def sources() -> str:
    """Digest of every source that decides what a run gives, whichever the controller."""
    owned = {PACKAGE / "control" / "distribution" / "controllers.py"}
    owned.update(
        file for made in CONTROLLERS.values() if inspect.isclass(made) for file in _files(made)
    )
    files = [
        p
        for room in (*ROOMS, "control")
        for p in (PACKAGE / room).rglob("*")
        if p.suffix in (".py", ".yaml")
    ]
    files += [
        *Path(__file__).parent.glob("*.py"),
        *(PACKAGE / "envs").glob("randomisation.*"),
    ]
    return _digest(path for path in files if path not in owned)


def _files(made: type) -> list[Path]:
    """The project's files that a class and its bases are written in."""
    return [
        Path(inspect.getfile(kind))
        for kind in made.__mro__
        if kind.__module__.startswith("testbed.")
    ]


def _digest(files: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


@lru_cache
def mark(name: str) -> str:
    """What a controller's runs depend on: the common sources, its own file and weights, those it is made from."""
    made = Quadratic if name == ORACLE else type(controller(name))
    own = _files(made)
    if name.endswith(".npz") or ":" in name:
        own.append(Path(name if name.endswith(".npz") else name.rpartition(":")[0]))
    weights = [path.with_suffix(".npz") for path in own if path.with_suffix(".npz").is_file()]
    return f"{sources()}-{_digest([*own, *weights])}"


def kept(file: Path, name: str) -> Outcome | None:
    """The outcome under a controller if the case's file has it from these sources."""
    entry = _read(file).get(name, {})
    return Outcome(**entry["outcome"]) if entry.get("mark") == mark(name) else None


def _read(file: Path) -> dict[str, Any]:
    read: dict[str, Any] = json.loads(file.read_text()) if file.is_file() else {}
    return read


def _keep(file: Path, name: str, outcome: Outcome) -> None:
    write_text(
        file, json.dumps(_read(file) | {name: {"mark": mark(name), "outcome": asdict(outcome)}})
    )


def _case(work: tuple[Path | None, Case, tuple[str, ...]]) -> tuple[str, list[Outcome]]:
    """One case under each controller, what is kept left as it is."""
    folder, case, names = work
    file, outcomes = folder / f"{case.key}.json" if folder is not None else None, []
    for name in names:
        known = kept(file, name) if file is not None else None
        outcomes.append(run_case(case, name) if known is None else known)
        if file is not None and known is None:
            _keep(file, name, outcomes[-1])
    return case.key, outcomes


def benchmark(
    count: int,
    jobs: int = 1,
    names: Sequence[str] = tuple(CONTROLLERS),
    progress: Callable[[int], None] | None = None,
    folder: Path | None = None,
    seeds: int = 1,
) -> dict[str, Any]:
    """`count` cases of each of `seeds` sets under all controllers and the oracle; the object of distribution.json.

    `folder` keeps the finished cases. Raises InputError for a wrong count or a folder that cannot be made.
    """
    for field, value in (("cases", count), ("jobs", jobs), ("seeds", seeds)):
        if value < 1:
            raise InputError("must be at least 1", field=field, value=value)
    if folder is not None:
        make_folder(folder)
    cases = draw_cases(count, seeds)
    work = [(folder, case, (*names, ORACLE)) for case in cases]
    found: dict[str, list[Outcome]] = {}
    for key, outcomes in work_through(_case, work, jobs, lambda _: False):
        found[key] = outcomes
        if progress is not None:
            progress(len(found))
    return summarise(cases, [found[case.key] for case in cases])


def summarise(cases: Sequence[Case], outcomes: Sequence[Sequence[Outcome]]) -> dict[str, Any]:
    """The object of distribution.json; beside it what was drawn of each case, and every outcome under `runs`."""
    affected = np.array([case.affected for case in cases])
    best = np.array([row[-1].friction_use for row in outcomes])
    table = []
    for k, first in enumerate(outcomes[0]):
        rows = [row[k] for row in outcomes]
        table.append({"name": first.controller, **_scores(rows, best, affected)})
    return {
        "cases": len(cases),
        "friction_use": "95th percentile over time of the highest tangential / (true friction * normal); 1 slides",
        "friction_use_regret": "friction use over the oracle's, less 1; _absolute: less the oracle's",
        "controllers": table,
        f"against_{BASE}": against_base(cases, outcomes),
        "drawn": [_drawn(case) for case in cases],
        "runs": [[asdict(outcome) for outcome in row] for row in outcomes],
    }


def _scores(rows: Sequence[Outcome], best: Array, affected: NDArray[np.bool_]) -> dict[str, Any]:
    use = np.array([r.friction_use for r in rows])
    regret, absolute = use / np.maximum(best, 1e-6) - 1.0, use - best
    lowest, hours = np.array([r.lowest_normal_n for r in rows]), sum(r.hours for r in rows)
    split = {
        f"friction_use_regret_median_{word}": float(np.median(regret[chosen]))
        if chosen.any()
        else None
        for word, chosen in (("undeclared", affected), ("declared", ~affected))
    }
    return {
        "friction_use_median": float(np.median(use)),
        "friction_use_regret_median": float(np.median(regret)),
        "friction_use_regret_p95": float(np.quantile(regret, 0.95)),
        "friction_use_regret_absolute_median": float(np.median(absolute)),
        "friction_use_regret_absolute_p95": float(np.quantile(absolute, 0.95)),
        **split,
        "lowest_normal_force_n": float(np.quantile(lowest, 0.05)),
        "lowest_normal_force_median_n": float(np.median(lowest)),
        "losses_per_hour": sum(r.losses for r in rows) / hours,
        "lost_cases": int(sum(r.losses > 0 for r in rows)),
        "infeasible": int(sum(r.infeasible for r in rows)),
        "plans_checked": int(sum(r.plans_checked for r in rows)),
        "solve_p99_s": float(np.quantile([r.solve_p99_s for r in rows], 0.5)),
        "solve_p99_worst_s": float(max(r.solve_p99_s for r in rows)),
        "body_motion_median_m": float(np.median([r.body_motion_m for r in rows])),
        "rope_range_median_n": float(np.median([r.rope_range_n for r in rows])),
        "valve_effort_mean": float(np.mean([r.valve_effort for r in rows])),
    }


def check(folder: Path, names: Sequence[str] | None) -> tuple[str, ...]:
    """The controllers asked for (None: all). Raises InputError for an unknown one or a folder that cannot be made."""
    chosen = tuple(names) if names else tuple(CONTROLLERS)
    for name in chosen:
        controller(name)
    make_folder(folder)
    return chosen


def table(result: dict[str, Any]) -> tuple[list[str], list[list[str]]]:
    """Head and rows of the table that a person wants to see."""
    head = [
        "controller",
        "friction use",
        "over the oracle's",
        "95 %",
        "lowest load [N]",
        "losses an hour",
        "infeasible",
        "solve p99 [ms]",
    ]
    rows = [
        [
            entry["name"],
            f"{entry['friction_use_median']:.3f}",
            f"{entry['friction_use_regret_median']:+.1%}",
            f"{entry['friction_use_regret_p95']:+.1%}",
            f"{entry['lowest_normal_force_n']:.0f}",
            f"{entry['losses_per_hour']:.0f}",
            f"{entry['infeasible']} of {entry['plans_checked']}",
            f"{1e3 * entry['solve_p99_s']:.2f}",
        ]
        for entry in result["controllers"]
    ]
    return head, rows


def write(result: dict[str, Any], folder: Path) -> Path:
    """Write DIR/distribution.json (without the single runs) and DIR/distribution.csv (a run a line).

    Returns the first one's path. Raises InputError where they cannot be written.
    """
    path = make_folder(folder) / "distribution.json"
    write_json(path, {key: value for key, value in result.items() if key not in ("drawn", "runs")})
    lines = [
        case | {key: _short(value) for key, value in outcome.items()}
        for case, row in zip(result["drawn"], result["runs"], strict=True)
        for outcome in row
    ]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(lines[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(lines)
    write_text(folder / "distribution.csv", text.getvalue())
    return path


def _drawn(case: Case) -> dict[str, Any]:
    """What a case's lines of the table begin with."""
    spec = case.scenario()
    return {
        "set": case.block,
        "case": case.number,
        "slope_deg": _short(spec.terrain.slope_deg),
        "friction": _short(spec.terrain.friction),
        "payload_kg": _short(spec.robot.payload_kg),
        "undeclared": " ".join(f"{u.effect}@{u.at}" for u in spec.undeclared),
    }


def _short(value: Any) -> Any:
    return f"{value:.6g}" if isinstance(value, float) else value
