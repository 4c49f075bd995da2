"""`report.html` of a run's folder, of a run that was killed too; a page that compares two runs."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Container, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

from testbed.errors import InputError
from testbed.formats.files import check_file, owned, write_text
from testbed.report.comparison import Side
from testbed.report.comparison import page as comparison
from testbed.report.run_report import Drawn, page
from testbed.report.run_report import pictures_of as report_pictures
from testbed.simulation.runs import (
    SCENARIO,
    RecordedRun,
    check_run,
    open_run,
    run_machines,
    run_scenario_of,
)

if TYPE_CHECKING:
    from testbed.machine.model import Machine
    from testbed.scenario.terrain import Terrain


def write_report(folder: str | Path, helpers: Drawers | None = None) -> Path:
    """Write `report.html` into a run's folder and return its path; works for a killed run too.

    helpers: processes that draw its pictures meanwhile. Raises InputError where the folder holds no
    readable run, and while the run is still being made.
    """
    check_run(folder)
    with owned(folder, field=None) as path:
        run, report = open_run(path), path / "report.html"
        with _shown(path):
            drawn = helpers.draw(path) if helpers is not None else None
            text = page(run, *_of(run), drawn)
        write_text(report, text)
    return report


def pictures_of(folder: Path, wanted: Container[int]) -> dict[int, Drawn]:
    """The pictures of a run's report by their number, those that are wanted."""
    run = open_run(folder)
    return report_pictures(run, *_of(run), wanted)


def _of(run: RecordedRun) -> tuple[dict[str, Any], Machine, Terrain | None]:
    """What a run comes to, the machine that it truly had, and its ground."""
    scenario = run_scenario_of(run.folder)
    terrain = scenario.terrain if scenario is not None else None
    return run.summary or _of_a_killed_run(run), run_machines(run.folder).truth, terrain


def write_comparison(folders: Sequence[Path], out: Path) -> Path:
    """Write a page that compares two runs, and return its path.

    Raises InputError where there are not two readable runs, or where `out` cannot be written.
    """
    if len(folders) != 2:
        raise InputError(
            "one run is looked at, or two are compared",
            field="RUN",
            value=len(folders),
            allowed="1 or 2",
        )
    path = check_file(out, (".html",))
    sides = [_side(folder) for folder in folders]
    if sides[0].name == sides[1].name:
        sides = [
            side._replace(name=str(folder)) for side, folder in zip(sides, folders, strict=True)
        ]
    with _shown(folders[1]):
        text = comparison(*sides)
    write_text(path, text)
    return path


def _side(folder: Path) -> Side:
    run = open_run(check_run(folder))
    if len(run.time_s) < 2:
        raise InputError(
            "is too short to compare", file=folder, allowed="a run of two rows and more"
        )
    return Side(folder.resolve().name, run, run.summary or _of_a_killed_run(run), _settings(folder))


def _settings(folder: Path) -> dict[str, Any]:
    """The scenario of a run as a tree; empty where its folder holds none."""
    from testbed.formats.yaml_files import read_yaml

    path = folder / SCENARIO
    return read_yaml(path) if path.is_file() else {}


@contextmanager
def _shown(folder: Path) -> Iterator[None]:
    """Turn what a run's edited or missing columns, fields and pictures raise into one line that
    names the run.
    """
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        raise InputError(
            f"holds a run that cannot be shown ({type(error).__name__}: {error})",
            file=folder,
            allowed="a run of this version, neither edited nor cut",
        ) from error


def _of_a_killed_run(run: RecordedRun) -> dict[str, Any]:
    """What can be said of a run that was killed before it was summed up."""
    from testbed.estimation.contact_losses import LossRule, nominal_load_n
    from testbed.simulation.metrics import run_metrics

    scenario = _settings(run.folder)
    slope_deg = float((scenario.get("terrain") or {}).get("slope_deg") or 0.0)
    rows = len(run.time_s)
    told = scenario.get("estimator") or {}
    known = {k: v for k, v in (("share", "loss_share"), ("shortest_s", "loss_s")) if v in told}
    rule = LossRule(
        nominal_load_n(run_machines(run.folder).belief),
        **{name: told[value] for name, value in known.items()},
    )
    return {
        "scenario": run.meta.get("scenario", run.folder.name),
        "seed": run.meta.get("seed", 0),
        "description": run.meta.get("description", ""),
        "verdict": "unknown: the run was killed",
        "slope_deg": slope_deg,
        "simulated_s": float(run.time_s[rows - 1]) if rows else 0.0,
        "wall_s": None,
        **(run_metrics(run.data, run.truth, slope_deg, rule) if rows > 1 else {}),
    }


# Processes that draw a run's report on the other core: they load what drawing needs while the run
# goes on.

WORKERS = 2
SHORTEST_S = 20.0
"""Simulated time of a run whose report is worth processes of its own."""


class Drawers:
    """Processes that draw; each takes every so many-th picture of a report."""

    def __init__(self) -> None:
        """Start them, and let them load what they need."""
        self._pool = ProcessPoolExecutor(
            WORKERS, mp_context=get_context("spawn"), initializer=_begin
        )
        for _ in range(WORKERS):
            self._pool.submit(_load)

    def draw(self, folder: Path) -> list[Drawn]:
        """All pictures of the run in `folder`, in order. Raises what drawing raises."""
        shares: list[Future[dict[int, Drawn]]] = [
            self._pool.submit(_draw, str(folder), share) for share in range(WORKERS)
        ]
        drawn: dict[int, Drawn] = {}
        for share in shares:
            drawn |= share.result()
        return [drawn[number] for number in sorted(drawn)]

    def close(self) -> None:
        """End them."""
        self._pool.shutdown(wait=False, cancel_futures=True)


@contextmanager
def drawers(simulated_s: float) -> Iterator[Drawers | None]:
    """Context: Drawers of a run of `simulated_s`; None where it is short or there is one core."""
    cores = os.sched_getaffinity(0) if sys.platform == "linux" else range(os.cpu_count() or 1)
    if simulated_s < SHORTEST_S or len(cores) < WORKERS:
        yield None
        return
    them = Drawers()
    try:
        yield them
    finally:
        them.close()


def _begin() -> None:
    """Ctrl-C is the run's, which sums itself up."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _load() -> None:
    """What every picture needs: the drawing library with its fonts, and what reads a run."""
    import testbed.workflows.report  # noqa: F401
    from testbed.report.style import new_figure, svg

    svg(new_figure(1, 2.0)[0], "first")


def _draw(folder: str, share: int) -> dict[int, Drawn]:
    """Number of a picture -> the picture, of every WORKERS-th from `share` on."""
    from testbed.workflows.report import pictures_of

    return pictures_of(Path(folder), range(share, 10**6, WORKERS))
