"""`testbed loop`: a machine with effects that it does not know: seen, found, added, and judged on
another scenario.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from testbed.formats.files import owned, write_json, write_text
from testbed.machine.names import LEGS
from testbed.report.loop_page import page

if TYPE_CHECKING:
    from testbed.scenario.scenario import Scenario

SCENARIOS = ("stand_undeclared_two",)
NEXT = "crawl_slope_45"
"""The other scenario: the same machine with the same effects walks instead of standing."""
NEXT_SEED = 100
"""Its seed is this much higher: other noise, other sensors' errors."""
SHOWN = 240
"""So many points of each course are kept for the page."""
Progress = Callable[[str], None]


def close_loop(
    out: Path, scenarios: Sequence[str] = SCENARIOS, tell: Progress | None = None
) -> dict[str, Any]:
    """Close the loop on every scenario in `out/<scenario>`; what is there already is not run again.

    Returns the contents of `loop.json`, written beside `loop.html`. Raises InputError for a folder
    that cannot be used.
    """
    from testbed.scenario.scenario import load_scenario

    say = tell or (lambda _: None)
    for name in scenarios:
        load_scenario(name)  # all of them can be used, before the first is run
    with owned(out):
        rows = [_row(name, out / Path(name).stem, say) for name in scenarios]
        result = {"scenarios": rows}
        write_json(out / "loop.json", result)
        write_text(out / "loop.html", page(rows))
    return result


def _row(name: str, folder: Path, say: Progress) -> dict[str, Any]:
    from testbed.scenario.scenario import load_scenario
    from testbed.simulation.run_summary import elsewhere, hidden_effects, hidden_numbers
    from testbed.workflows.diagnose import Wanted, diagnose_folder

    scenario = load_scenario(name)
    say(f"{name}: first run")
    _run(folder / "first", scenario, None)
    findings = folder / "diagnosis" / "findings.json"
    if not findings.is_file():
        say(f"{name}: diagnosis")
        diagnose_folder(folder / "first", folder / "diagnosis", Wanted())
    found = json.loads(findings.read_text())
    say(f"{name}: another scenario, as believed")
    other = elsewhere(scenario, NEXT, scenario.seed + NEXT_SEED)
    before = _run(folder / "next_before", other, None)
    say(f"{name}: another scenario, with what was found")
    after = _run(folder / "next_after", other, folder / "diagnosis" / "model.yaml")
    return {
        "scenario": name,
        "next": other.name,
        "hidden": hidden_effects(scenario),
        "truth": hidden_numbers(scenario),
        "effects": found["effects"],
        "believed": found.get("believed", True),
        **_said(found),
        "residual_n": found["error"]["force_n"],
        **_errors(before, after),
        "seen": _course(folder / "first"),
        "courses": {
            "before": _course(folder / "next_before"),
            "after": _course(folder / "next_after"),
        },
    }


def _run(folder: Path, scenario: Scenario, model: Path | None) -> dict[str, Any]:
    """The run's summary; a run that is there already is kept."""
    from testbed.simulation.run import run_scenario
    from testbed.simulation.sweep import summary_of
    from testbed.workflows.report import write_report

    if summary_of(folder) is None:
        if run_scenario(scenario, folder, model).interrupted:
            raise KeyboardInterrupt
        write_report(folder)
    summary: dict[str, Any] = json.loads((folder / "summary.json").read_text())
    return summary


def _course(folder: Path) -> dict[str, list[float]]:
    """Error of the own estimate of every foot over time, N, as means over equal stretches, and
    their middle `t`, s.
    """
    from testbed.simulation.runs import read_run

    run = read_run(folder)
    width = max(len(run.data["t"]) // SHOWN, 1)
    count = len(run.data["t"]) // width

    def means(values: Any) -> list[float]:
        kept = np.asarray(values, dtype=float)[: count * width].reshape(count, width)
        return [round(float(v), 3) for v in kept.mean(axis=1)]

    errors = {leg: run.data[f"estimate_own_{leg}"] - run.truth[f"foot_load_{leg}"] for leg in LEGS}
    return {"t": means(run.data["t"]), **{leg: means(error) for leg, error in errors.items()}}


def _said(found: Mapping[str, Any]) -> dict[str, Any]:
    if found["effects"]:
        words = [
            f"{effect['name']} at {effect['place'].replace('_', ' ')}"
            for effect in found["effects"]
        ]
        return {"said": ", ".join(words), "probability": found["effects"][0]["probability"]}
    return {"said": found["verdict"], "probability": found["hypotheses"][0]["probability"]}


def _errors(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    by_leg = {
        stage: summary["force_rms_by_leg_n"]["own"]
        for stage, summary in (("before", before), ("after", after))
    }
    whole = {
        stage: float(np.sqrt(np.mean([row[leg] ** 2 for leg in LEGS])))
        for stage, row in by_leg.items()
    }
    return {"by_leg_n": by_leg, "before_n": whole["before"], "after_n": whole["after"]}


def table(result: Mapping[str, Any]) -> tuple[list[str], list[list[str]]]:
    """(header, rows) for the console."""
    rows = [
        [
            scenario["scenario"],
            scenario["hidden"],
            scenario["said"],
            f"{scenario['before_n']:.0f} N",
            f"{scenario['after_n']:.0f} N",
        ]
        for scenario in result["scenarios"]
    ]
    return ["scenario", "hidden", "said", f"{NEXT} before", "after"], rows
