"""The diagnosis names what was hidden, with its size, and leaves a clean rig alone."""

from __future__ import annotations

import json
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from testbed.benchmarks.diagnosis.scores import calibration, rate
from testbed.benchmarks.reference_leg.rigs import Hidden, make_rig
from testbed.diagnosis.leg.diagnose import diagnose
from testbed.diagnosis.leg.evidence import Evidence, correlation_time, student
from testbed.diagnosis.leg.experiments import experiments, write_motion
from testbed.diagnosis.leg.findings import as_json, write_findings
from testbed.diagnosis.leg.search import Candidate, Search
from testbed.diagnosis.leg.verdict import Verdict
from testbed.effects import OF_A_CYLINDER
from testbed.recording.axis import read_rig
from testbed.recording.known import Known
from testbed.recording.leg_model import read_model
from testbed.report.diagnosis_page import page, rivals


def test_student_scale_of_normal_noise_with_bursts_is_that_of_the_noise() -> None:
    rng = np.random.default_rng(1)
    r = 3.0 * rng.standard_normal(20000)
    scale, _ = student(r)
    r[:40] = 500.0
    burst, _ = student(r)
    assert burst < 1.03 * scale < 3.3


def test_correlation_time_of_white_noise_is_one_and_of_a_held_series_its_hold() -> None:
    rng = np.random.default_rng(2)
    white = rng.standard_normal(20000)
    assert correlation_time(white) == pytest.approx(1.0, abs=0.25)
    assert correlation_time(np.repeat(white[:2000], 10)) == pytest.approx(10.0, rel=0.25)


def test_every_name_has_an_experiment_that_shows_it() -> None:
    names = [effect.name for effect in OF_A_CYLINDER]
    assert [name for name, _ in experiments(names)] == names


def test_a_suggested_motion_stays_inside_the_stroke(tmp_path: Path) -> None:
    write_motion(tmp_path / "m.csv", Known(stroke_m=0.5))
    x = np.loadtxt(tmp_path / "m.csv", delimiter=",", skiprows=1)[:, 1]
    assert 0.03 < x.min() < x.max() < 0.47


def test_wilson_interval_of_eight_in_ten() -> None:
    found = rate([True] * 8 + [False] * 2)
    assert (found["low95"], found["high95"]) == pytest.approx((0.490, 0.943), abs=2e-3)


def test_calibration_error_of_a_sure_and_wrong_forecaster_is_one() -> None:
    trial = {
        "visible": True,
        "kind": "single",
        "truth": ["a"],
        "hypotheses": [{"names": ["b"], "probability": 1.0}],
    }
    assert calibration([trial])["expected_calibration_error"] == pytest.approx(1.0)


def hide(
    monkeypatch: pytest.MonkeyPatch, numbers: dict[str, float], names: tuple[str, ...]
) -> None:
    hidden = Hidden(names, (1.0,) * len(names), numbers, (0,) * len(names))
    monkeypatch.setattr(
        "testbed.benchmarks.reference_leg.rigs.draw_hidden", lambda rng, kind: hidden
    )


@pytest.mark.slow
def test_a_hidden_gain_is_named_with_its_size_and_the_error_falls(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    hide(monkeypatch, {"sensor.gain_b:gain": 0.04}, ("sensor.gain_b",))
    found = diagnose(make_rig(12, "single")[0])
    write_findings(found, tmp_path)
    said = json.loads((tmp_path / "findings.json").read_text())
    assert said["verdict"] == "effect" and [e["name"] for e in said["effects"]] == ["sensor.gain_b"]
    assert said["effects"][0]["parameters"]["gain_error"]["value"] == pytest.approx(0.04, abs=0.004)
    assert sum(h["probability"] for h in said["hypotheses"]) == pytest.approx(1.0, abs=1e-9)
    error = said["error"]["force_n"]
    closed = (error["refit"] ** 2 - error["after"] ** 2) / (
        error["refit"] ** 2 - error["floor"] ** 2
    )
    assert closed >= 0.85  # of the squared error that can be closed
    model = read_model(tmp_path / "model.yaml")
    assert model.effects[0].name == "sensor.gain_b"
    assert read_model(tmp_path / "model_refit.yaml").effects == ()
    again = as_json(diagnose(make_rig(12, "single")[0], model=model))
    assert again["verdict"] == "none" and again["effects"] == []
    assert again["error"]["force_n"]["before"] == pytest.approx(error["after"], rel=1e-6)


KEY = ("force", "sine")


def candidate(names: tuple[str, ...], gain: float) -> Candidate:
    """A set that gains so much in its one group, of noise 100 N over 1 + gain / 100."""
    fit: Any = SimpleNamespace(at=SimpleNamespace(effects=()), coordinates=(), theta=())
    found = Evidence(
        {KEY: gain}, {KEY: 100.0 / (1.0 + gain / 100.0)}, {KEY: 100.0}, {KEY: 1.0}, {KEY: 1000}
    )
    return Candidate(names, fit, found)


def tried(chosen: int, weights: dict[tuple[str, ...], float], kind: str) -> tuple[Search, Verdict]:
    """A search of the plain model and two effects that gain 12 and -5, and the verdict that was
    made of it.
    """
    sets = [
        candidate((), 0.0),
        candidate(("inertia.mass",), 12.0),
        candidate(("sensor.delay",), -5.0),
    ]
    problem: Any = SimpleNamespace(kind="drive", series=())
    state = Search(problem, sets[0], {frozenset(c.names): c for c in sets})
    return state, Verdict(kind, sets[chosen], tuple(weights.items()), {})


def test_where_none_is_named_the_page_says_what_the_effects_gain_and_that_it_is_too_little() -> (
    None
):
    state, verdict = tried(
        0, {(): 0.7, ("inertia.mass",): 0.25, ("inertia.mass", "sensor.delay"): 0.05}, "none"
    )
    first, second = rivals(state, verdict)
    assert (first["names"], first["ahead"], second["ahead"]) == ("inertia.mass", 12.0, -5.0)
    assert (first["probability"], second["probability"]) == (
        pytest.approx(0.3),
        pytest.approx(0.05),
    )
    assert first["where"] == "force in sine" and first["scale"] == (
        pytest.approx(100.0 / 1.12),
        100.0,
    )


def test_a_runner_up_of_a_named_effect_is_behind_it() -> None:
    state, verdict = tried(1, {("inertia.mass",): 0.9, (): 0.1}, "effect")
    (behind,) = rivals(state, verdict)
    assert (behind["names"], behind["ahead"]) == ("sensor.delay", -17.0)


@pytest.mark.slow
def test_a_clean_rig_is_left_alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    hide(monkeypatch, {}, ())
    found = diagnose(make_rig(10, "clean")[0])
    assert as_json(found)["verdict"] == "none"
    assert found.models["after"] in (found.models["refit"], found.models["identify"])
    error = found.errors.total("force_n")
    assert error["after"] <= 1.02 * min(error["refit"], error["identify"])
    text = page(found)
    assert "Why no effect was named" in text and "runners-up" not in text
    assert f"nothing is missing is {found.verdict.hypotheses[0][1]:.3f}" in text


@pytest.mark.slow
def test_a_spring_that_stiffens_is_named_although_a_straight_one_carries_over_to_no_other_block() -> (
    None
):
    rig, hidden = make_rig(8157, "single")
    assert hidden.names == ("force.spring",)
    assert [e.name for e in diagnose(rig).entries] == ["force.spring"]


@pytest.mark.slow
def test_an_answered_outside_rig_is_named() -> None:
    data = os.environ.get("TESTBED_DATA")
    if not data or not (Path(data) / "recordings" / "rig-09").is_dir():
        pytest.skip("TESTBED_DATA does not name a folder with recordings/rig-09")
    found = diagnose(read_rig(Path(data) / "recordings" / "rig-09"))
    assert [e.name for e in found.entries] == ["leakage.internal"]
    assert found.entries[0].values["coefficient"] == pytest.approx(5.647e-12, rel=0.03)
