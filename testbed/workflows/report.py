"""`report.html` of a run's folder, of a run that was killed too."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from testbed.errors import InputError
from testbed.formats.files import write_text
from testbed.formats.ownership import owned
from testbed.report.run_report import page
from testbed.simulation.runs import RecordedRun, check_run, read_run, run_machines


def write_report(folder: str | Path) -> Path:
    """Write `report.html` into a run's folder and return its path; works for a killed run too.

    Raises InputError where the folder holds no readable run, and while the run is still being made.
    """
    check_run(folder)
    with owned(folder, field=None) as path:
        run, report = read_run(path), path / "report.html"
        with _shown(path):
            summary = run.summary or _of_a_killed_run(run)
            text = page(run, summary, run_machines(path).truth)
        write_text(report, text)
    return report


@contextmanager
def _shown(folder: Path) -> Iterator[None]:
    """Turn what a run's edited or missing columns, fields and pictures raise into one line that names the run."""
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
    from testbed.estimation.losses import LossRule, nominal_load_n
    from testbed.formats.yaml_files import read_yaml
    from testbed.simulation.metrics import run_metrics

    path = run.folder / "scenario.yaml"
    scenario = read_yaml(path) if path.is_file() else {}
    slope_deg = float((scenario.get("terrain") or {}).get("slope_deg") or 0.0)
    rows = len(run.time_s)
    told = (scenario.get("estimator") or {}) if scenario else {}
    known = {k: v for k, v in (("share", "loss_share"), ("shortest_s", "loss_s")) if v in told}
    rule = LossRule(
        nominal_load_n(run_machines(path.parent).belief), **{k: told[v] for k, v in known.items()}
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
