"""The loop over runs and a diagnosis: what is kept, what is made anew, what is refused before."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from testbed.errors import InputError
from testbed.machine.names import LEGS
from testbed.report import loop_page
from testbed.scenario.scenario import Scenario
from testbed.simulation import sweep
from testbed.simulation.run_folder import spelt
from testbed.workflows import loop as work
from testbed.workflows.loop import close_loop

OWN = "format: roboclimber-scenario/1\nname: own\nduration_s: 5\nseed: {seed}\n"
COURSE: dict[str, list[float]] = {"t": [0.0, 1.0], **{leg: [0.0, 1.0] for leg in LEGS}}


class Made:
    """Stands for runs and diagnoses; lists their folders."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folders = list[str]()
        monkeypatch.setattr("testbed.simulation.run.run_scenario", self.run)
        monkeypatch.setattr("testbed.workflows.diagnose.diagnose_folder", self.diagnose)
        monkeypatch.setattr("testbed.workflows.report.write_report", lambda folder: None)
        monkeypatch.setattr(work, "_course", lambda folder: COURSE)

    def run(self, scenario: Scenario, folder: Path, model: Path | None) -> Any:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "scenario.yaml").write_text(spelt(scenario))
        error = {"own": dict.fromkeys(LEGS, float(scenario.seed))}
        summary = {"interrupted": False, "made_by": sweep.MADE_BY, "force_rms_by_leg_n": error}
        (folder / "summary.json").write_text(json.dumps(summary))
        self.folders.append(folder.name)
        return type("Result", (), {"interrupted": False})

    def diagnose(self, run: Path, folder: Path, wanted: object) -> None:
        folder.mkdir(exist_ok=True)
        hypotheses = [{"probability": 0.9}]
        found = {"effects": [], "verdict": "none", "hypotheses": hypotheses}
        found["error"] = {"force_n": {"before": 1.0}}
        (folder / "findings.json").write_text(json.dumps(found))
        self.folders.append(folder.name)


ALL = ["first", "diagnosis", "next_before", "next_after"]


@pytest.mark.slow
def test_what_is_there_is_kept_and_made_anew_for_another_scenario_of_that_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, own = Made(monkeypatch), tmp_path / "own.yaml"
    for seed, expected in ((1, ALL), (1, []), (2, ALL)):
        own.write_text(OWN.format(seed=seed))
        made.folders.clear()
        result = close_loop(tmp_path / "out", [str(own)])
        assert made.folders == expected
        assert result["scenarios"][0]["before_n"] == seed + 100.0


def test_what_another_version_made_is_made_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, own = Made(monkeypatch), tmp_path / "own.yaml"
    own.write_text(OWN.format(seed=1))
    with monkeypatch.context() as earlier:
        earlier.setattr(sweep, "MADE_BY", "roboclimber-testbed 0.1.0")
        close_loop(tmp_path / "out", [str(own)])
    made.folders.clear()
    close_loop(tmp_path / "out", [str(own)])
    assert made.folders == ALL


def test_a_diagnosis_that_is_made_anew_is_judged_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, own = Made(monkeypatch), tmp_path / "own.yaml"
    own.write_text(OWN.format(seed=1))
    close_loop(tmp_path / "out", [str(own)])
    (tmp_path / "out" / "own" / "diagnosis" / "findings.json").unlink()
    made.folders.clear()
    close_loop(tmp_path / "out", [str(own)])
    assert made.folders == ["diagnosis", "next_after"]


def test_what_would_fail_after_the_first_run_is_refused_before_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, short = Made(monkeypatch), tmp_path / "short.yaml"
    short.write_text(OWN.format(seed=1).replace("duration_s: 5", "duration_s: 2"))
    for scenarios, word in (
        (["quarter_model_stand"], "cannot be judged in crawl_slope_45"),
        ([str(short)], "too short to learn from"),
        (["stand_flat", "stand_flat"], "would share a folder"),
    ):
        with pytest.raises(InputError, match=word):
            close_loop(tmp_path / "out", scenarios)
    assert not made.folders and not (tmp_path / "out").exists()


def test_the_page_of_a_sound_machine_says_that_nothing_was_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Made(monkeypatch)
    rows = close_loop(tmp_path / "out", ["stand_flat"])["scenarios"]
    text = loop_page.page(rows)
    assert "No effect that its model lacks" in text and "Nothing is added" in text
    assert "are off" not in text
