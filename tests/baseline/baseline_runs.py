"""Ten short runs whose numbers a rebuild must leave alone, thinned to a few rows each.

`python tests/baseline/baseline_runs.py` records them anew: a change of the physics does that in a
commit of its own, and says what changed.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from testbed.recording.former import current
from testbed.scenario.scenario import load_scenario
from testbed.simulation.run import run_scenario
from testbed.simulation.runs import read_series

FOLDER = Path(__file__).parent / "recorded"
FIRST_ROWS = 20
"""The first rows are kept one by one: there a changed order of operations shows before chaos
does.
"""
ROW_STEP = 250
"""After them every so many rows are kept."""


@dataclass(frozen=True)
class BaselineRun:
    """A shipped scenario, cut short, with overrides that make it show what it is here for."""

    scenario: str
    duration_s: float
    overrides: tuple[str, ...] = ()


RUNS: dict[str, BaselineRun] = {
    "drill": BaselineRun("drill_slope_45", 12.0),
    "drill_deep": BaselineRun("drill_deep", 12.0),
    "crawl": BaselineRun("crawl_slope_30", 14.0),
    "wave_gait": BaselineRun("crawl_wave_45", 10.0),
    "rough_ground": BaselineRun("crawl_rough_45", 8.0),
    "rope_cut": BaselineRun("rope_cut", 8.0),
    "undeclared_leak": BaselineRun("stand_undeclared_leak", 8.0),
    "sensor_dead": BaselineRun("sensor_dead", 8.0),
    "supervisor": BaselineRun(
        "drill_wall_85",
        10.0,
        ("control.supervisor=true", "control.distribution=qp", "task.phases.0.feed_n=7000"),
    ),
    "soft_ground": BaselineRun("soft_patch", 8.0),
}


@dataclass(frozen=True)
class Recorded:
    """Thinned columns of a run and what its summary says of it."""

    columns: dict[str, NDArray[np.float64]]
    verdict: str
    figures: dict[str, float]


def make(name: str, folder: Path) -> Recorded:
    """Simulate the run and thin it."""
    run = RUNS[name]
    scenario = load_scenario(run.scenario, list(run.overrides), duration=run.duration_s)
    summary = run_scenario(scenario, folder / name).summary
    columns = {}
    for series in ("data", "truth"):
        for column, values in read_series(folder / name, series).items():
            keep = np.unique(np.r_[: min(FIRST_ROWS, len(values)), : len(values) : ROW_STEP])
            columns[f"{series}/{column}"] = np.asarray(values, dtype=np.float64)[keep]
    figures = {
        f"force_rms_n/{method}": float(value) for method, value in summary["force_rms_n"].items()
    }
    return Recorded(columns, str(summary["verdict"]), figures)


def _current(key: str) -> str:
    """`series/column` by today's name of the column."""
    series, _, column = key.partition("/")
    return f"{series}/{current(column)}"


def load(name: str) -> Recorded:
    """The recorded run of this name."""
    with np.load(FOLDER / f"{name}.npz", allow_pickle=False) as stored:
        columns = {
            _current(str(key)): values
            for key, values in zip(stored["names"], stored["values"], strict=True)
        }
        figures = {
            str(key): float(v)
            for key, v in zip(stored["figure_names"], stored["figures"], strict=True)
        }
        return Recorded(columns, str(stored["verdict"]), figures)


def save(name: str, recorded: Recorded) -> None:
    """Keep the run."""
    FOLDER.mkdir(exist_ok=True)
    np.savez_compressed(
        FOLDER / f"{name}.npz",
        names=np.array(list(recorded.columns)),
        values=np.array(list(recorded.columns.values())),
        figure_names=np.array(list(recorded.figures)),
        figures=np.array(list(recorded.figures.values())),
        verdict=np.array(recorded.verdict),
    )


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        for wanted in sys.argv[1:] or list(RUNS):
            save(wanted, make(wanted, Path(folder)))
            print(f"recorded {wanted}")
