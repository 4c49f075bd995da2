"""`testbed loop`: a machine with effects that it does not know: seen, found, added, and judged on
another scenario.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from testbed.errors import InputError
from testbed.formats.files import owned, read_json, write_json, write_text
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
SUMMARY = "summary.json"
"""A run whose folder has one is done."""
Progress = Callable[[str], None]


def close_loop(
    out: Path, scenarios: Sequence[str] = SCENARIOS, tell: Progress | None = None
) -> dict[str, Any]:
    """Close the loop on every scenario in `out/<scenario>`; of the very same scenario what is there
    already is not run again.

    Returns the contents of `loop.json`, written beside `loop.html`. Raises InputError, before the
    first of them is run, for a folder or a scenario that cannot be used.
    """
    from testbed.scenario.scenario import load_scenario

    say = tell or (lambda _: None)
    folders = {Path(name).stem: name for name in scenarios}
    if len(folders) < len(scenarios):
        raise InputError(
            "would share a folder",
            field="--scenario",
            value=", ".join(scenarios),
            allowed="scenarios with file names of their own, each once",
        )
    loaded = {name: load_scenario(name) for name in scenarios}
    for name, scenario in loaded.items():
        _check_long_enough(scenario, name)
        _next_of(scenario, name)
    with owned(out):
        rows = [_row(name, out / folder, say) for folder, name in folders.items()]
        result = {"scenarios": rows}
        write_json(out / "loop.json", result)
        write_text(out / "loop.html", page(rows))
    return result


def _check_long_enough(scenario: Scenario, name: str) -> None:
    """Refuse what a diagnosis would refuse after the run."""
    from testbed.diagnosis.robot.diagnose import SHORTEST_S

    if scenario.duration_s < SHORTEST_S:
        raise InputError(
            "is too short to learn from",
            file=name,
            field="duration_s",
            value=scenario.duration_s,
            allowed=f"at least {SHORTEST_S:.3g} s",
        )


def _next_of(scenario: Scenario, name: str) -> Scenario:
    """The other scenario for the machine of this one. Raises InputError where that machine cannot
    be in it.
    """
    from testbed.simulation.run_summary import elsewhere

    try:
        return elsewhere(scenario, NEXT, scenario.seed + NEXT_SEED)
    except InputError as error:
        raise InputError(
            f"its machine cannot be judged in {NEXT}: {error.problem}",
            file=name,
            field=error.field,
            value=error.value,
            allowed=error.allowed,
        ) from error


def _row(name: str, folder: Path, say: Progress) -> dict[str, Any]:
    from testbed.scenario.scenario import load_scenario
    from testbed.simulation.run_summary import hidden_effects, hidden_numbers
    from testbed.simulation.sweep import holds_run
    from testbed.workflows.diagnose import FINDINGS, Wanted, diagnose_folder

    scenario = load_scenario(name)
    diagnosis = folder / "diagnosis"
    say(f"{name}: first run")
    if not holds_run(folder / "first", scenario):
        _forget(diagnosis / FINDINGS)
        _run(folder / "first", scenario, None)
    if not (diagnosis / FINDINGS).is_file():
        say(f"{name}: diagnosis")
        _forget(folder / "next_after" / SUMMARY)
        diagnose_folder(folder / "first", diagnosis, Wanted())
    found = json.loads((diagnosis / FINDINGS).read_text())
    say(f"{name}: another scenario, as believed")
    other = _next_of(scenario, name)
    before = _run(folder / "next_before", other, None)
    say(f"{name}: another scenario, with what was found")
    after = _run(folder / "next_after", other, diagnosis / "model.yaml")
    return {
        "scenario": name,
        "next": other.name,
        "hidden": hidden_effects(scenario),
        "truth": hidden_numbers(scenario),
        "effects": found["effects"],
        "not_believed": found.get("not_believed", ""),
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
    """The run's summary; a run of this very scenario that is there already is kept."""
    from testbed.simulation.run import run_scenario
    from testbed.simulation.sweep import holds_run
    from testbed.workflows.report import write_report

    if not holds_run(folder, scenario):
        if run_scenario(scenario, folder, model).interrupted:
            raise KeyboardInterrupt
        write_report(folder)
    return read_json(folder / SUMMARY)


def _forget(file: Path) -> None:
    """Take away the file by which a folder counts as made: what it was made from is made anew."""
    file.unlink(missing_ok=True)


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
