"""`report.html` of a run's folder, of a run that was killed too; a page that compares two runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from testbed.errors import InputError
from testbed.estimation.contact_losses import LossRule, nominal_load_n
from testbed.formats.files import check_file, owned, write_text
from testbed.report.comparison import Side
from testbed.report.comparison import page as comparison
from testbed.report.run_report import Drawn, page, pictures_of
from testbed.scenario.machines import machines_of
from testbed.simulation.copies import Copy, SharedOut, can_copy
from testbed.simulation.metrics import methods, run_metrics
from testbed.simulation.residuals import residual_summary
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
    from testbed.scenario.machines import Machines
    from testbed.scenario.scenario import Scenario
    from testbed.scenario.terrain import Terrain


def write_report(folder: str | Path, helpers: Drawers | None = None) -> Path:
    """Write `report.html` into a run's folder and return its path; works for a killed run too.

    helpers: processes that may have begun to draw its pictures. Raises InputError where the folder
    holds no readable run, and while the run is still being made.
    """
    check_run(folder)
    with owned(folder, field=None) as path:
        run, report = open_run(path), path / "report.html"
        with _shown(path):
            drawn = helpers.drawn if helpers is not None and helpers.begun else None
            text = page(run, *_of(run), drawn)
        write_text(report, text)
    return report


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
    scenario = _settings(run.folder)
    slope_deg = float((scenario.get("terrain") or {}).get("slope_deg") or 0.0)
    rows = len(run.time_s)
    estimator = scenario.get("estimator") or {}
    known = {k: v for k, v in (("share", "loss_share"), ("shortest_s", "loss_s")) if v in estimator}
    rule = LossRule(
        nominal_load_n(run_machines(run.folder).belief),
        **{name: estimator[value] for name, value in known.items()},
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


# Copies of this process that draw a run's report: they load what drawing needs on the other core
# while the run goes on.

MOST_PICTURES = 64
"""More than any report has."""
FIGURES_BY_ROWS = {1: 2, 2: 1, 3: 2, 4: 5, 6: 2}
"""Number of axes -> figures with so many in a report of a run that drills; what another run's
report has besides is made when it is drawn.
"""
SHORTEST_S = 20.0
"""Simulated time of a run whose report is worth processes of its own."""


class Drawers:
    """Draw a report's pictures: one copy of this process and a copy of that share them out."""

    def __init__(self, scenario: Scenario) -> None:
        """Make the first copy, and let it load what a run of `scenario` needs; what this process
        needs too is loaded here.
        """
        import testbed.simulation.live_run  # noqa: F401

        self.begun = False
        """Whether there is a run that they draw."""
        self._scenario = scenario
        self._copy = Copy(self._work)
        self._copy.begin(None)

    def begin(self, folder: Path, by_world: dict[str, Any]) -> None:
        """Begin to draw all pictures of the run whose rows are in `folder`, of which the world
        tells so much (see `world_part`); it need not be summed up yet.
        """
        self.begun = True
        self._copy.begin((folder, by_world))

    def drawn(self) -> list[Drawn]:
        """The pictures, in order. Raises what drawing raises."""
        pictures: dict[int, Drawn] = self._copy.results()[-1]
        return [pictures[number] for number in sorted(pictures)]

    def close(self) -> None:
        """End it."""
        self._copy.close()

    def _work(self, piece: tuple[Path, dict[str, Any]] | None) -> dict[int, Drawn]:
        """In the copy: the pictures of a run by their number; without one, load what all need."""
        if piece is None:
            self._machines = _loaded(self._scenario)
            return {}
        with (
            closing(SharedOut(MOST_PICTURES)) as wanted,
            closing(Copy(lambda _: self._share(*piece, wanted))) as other,
        ):
            other.begin(None)
            drawn = self._share(*piece, wanted)
            drawn |= other.results()[0]
        return drawn

    def _share(self, folder: Path, by_world: dict[str, Any], wanted: SharedOut) -> dict[int, Drawn]:
        """Those of the pictures that nobody else has begun."""
        run = open_run(folder)
        nominal_n = nominal_load_n(self._machines.belief)
        found = residual_summary(run.data, methods(run.data), nominal_n)
        by_world = by_world | {"residuals": found}
        return pictures_of(run, by_world, self._machines.truth, self._scenario.terrain, wanted)


@contextmanager
def drawers(scenario: Scenario) -> Iterator[Drawers | None]:
    """Context: Drawers of a run of `scenario`; None where it is short or there is one core."""
    if scenario.duration_s < SHORTEST_S or not can_copy():
        yield None
        return
    them = Drawers(scenario)
    try:
        yield them
    finally:
        them.close()


def _loaded(scenario: Scenario) -> Machines:
    """The run's machines; with them the drawing library and its fonts, the kinematics, and what
    reads a run.
    """
    import pyarrow.parquet  # noqa: F401

    from testbed.report.style import new_figure, prepare_figures, svg
    from testbed.robot.robot import Robot

    svg(new_figure(1, 2.0)[0], "first")
    prepare_figures(FIGURES_BY_ROWS)
    machines = machines_of(scenario)
    Robot.of(machines.truth)
    return machines
