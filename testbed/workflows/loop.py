"""`testbed loop`: run, diagnose, believe, run again; what that does to the foot-force error, leg by leg."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from testbed.formats.files import write_json, write_text
from testbed.formats.ownership import owned
from testbed.machine.names import LEGS
from testbed.report.loop_page import page

SCENARIOS = (
    "stand_clean",
    "stand_undeclared_gain",
    "stand_undeclared_leak",
    "stand_undeclared_friction",
    "stand_undeclared_drift",
)
NEXT_SEED = 100
"""The next run's seed is this much higher: other noise, other sensors' errors."""
Progress = Callable[[str], None]


def close_loop(
    out: Path, scenarios: Sequence[str] = SCENARIOS, tell: Progress | None = None
) -> dict[str, Any]:
    """Close the loop on every scenario in `out/<scenario>`; what is there already is not run again.

    Returns the contents of `loop.json`, written beside `loop.html`. Raises InputError for a folder that cannot be used.
    """
    from testbed.scenario.scenario import load_scenario

    say = tell or (lambda _: None)
    for name in scenarios:
        load_scenario(name)  # all of them can be used, before the first is run
    with owned(out):
        rows = [_row(name, out / name, say) for name in scenarios]
        result = {"scenarios": rows}
        write_json(out / "loop.json", result)
        write_text(out / "loop.html", page(rows))
    return result


def _row(name: str, folder: Path, say: Progress) -> dict[str, Any]:
    from testbed.scenario.scenario import load_scenario
    from testbed.simulation.expectations import hidden_effects
    from testbed.workflows.diagnose import diagnose_folder

    scenario = load_scenario(name)
    say(f"{name}: first run")
    first = _run(folder / "first", name, scenario.seed, None)
    findings = folder / "diagnosis" / "findings.json"
    if not findings.is_file():
        say(f"{name}: diagnosis")
        diagnose_folder(folder / "first", folder / "diagnosis", None, None, lambda _: None)
    found = json.loads(findings.read_text())
    say(f"{name}: next run")
    after = _run(
        folder / "next", name, scenario.seed + NEXT_SEED, folder / "diagnosis" / "model.yaml"
    )
    return {
        "scenario": name,
        "hidden": hidden_effects(scenario),
        **_said(found),
        **_errors(found, first, after),
    }


def _run(folder: Path, name: str, seed: int, model: Path | None) -> dict[str, Any]:
    """The run's summary; a run that is there already is kept."""
    from testbed.scenario.scenario import load_scenario
    from testbed.simulation.run import run_scenario
    from testbed.workflows.report import write_report

    if not (folder / "summary.json").is_file():
        run_scenario(load_scenario(name, [], seed), folder, model)
        write_report(folder)
    summary: dict[str, Any] = json.loads((folder / "summary.json").read_text())
    return summary


def _said(found: Mapping[str, Any]) -> dict[str, Any]:
    if found["effects"]:
        words = [f"{e['name']} at {e['place'].replace('_', ' ')}" for e in found["effects"]]
        return {"said": ", ".join(words), "probability": found["effects"][0]["probability"]}
    return {"said": found["verdict"], "probability": found["hypotheses"][0]["probability"]}


def _errors(
    found: Mapping[str, Any], first: Mapping[str, Any], after: Mapping[str, Any]
) -> dict[str, Any]:
    by_leg = {k: s["force_rms_by_leg_n"]["own"] for k, s in (("before", first), ("after", after))}
    places = [e["place"].split("_")[0] for e in found["effects"]]
    leg = places[0] if places else max(LEGS, key=lambda x: by_leg["before"][x])
    others = [x for x in LEGS if x != leg]
    return {
        "leg": leg,
        "before_n": by_leg["before"][leg],
        "after_n": by_leg["after"][leg],
        "others_before_n": max(by_leg["before"][x] for x in others),
        "others_after_n": max(by_leg["after"][x] for x in others),
        "by_leg_n": by_leg,
    }


def table(result: Mapping[str, Any]) -> tuple[list[str], list[list[str]]]:
    """(header, rows) for the console."""
    rows = [
        [r["scenario"], r["hidden"], r["said"], f"{r['before_n']:.0f} N", f"{r['after_n']:.0f} N"]
        for r in result["scenarios"]
    ]
    return ["scenario", "hidden", "said", "before", "next run"], rows
