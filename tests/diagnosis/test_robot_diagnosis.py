"""A whole robot's run: sound it is left alone, an effect is named with its place, and its model
file believes it.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from testbed.benchmarks.diagnosis.robot_benchmark import RobotBlindTest
from testbed.benchmarks.diagnosis.robot_calibration import fit, restated
from testbed.benchmarks.diagnosis.robot_draws import KINDS, MOTIONS, drawn
from testbed.benchmarks.diagnosis.robot_intervals import fitted_doubt
from testbed.benchmarks.diagnosis.robot_scores import calibration as calibration_of_stated
from testbed.benchmarks.diagnosis.robot_scores import scores, target
from testbed.benchmarks.harness import LINES
from testbed.diagnosis.leg.findings import FORMAT
from testbed.diagnosis.robot.diagnose import (
    NO_ROPES,
    PLACE_IN_DOUBT,
    SHORTEST_S,
    RobotDiagnosis,
    Verdict,
    beyond_what_was_tried,
    check_duration,
)
from testbed.diagnosis.robot.findings import as_json, models, summary_rows
from testbed.diagnosis.robot.groups import FORCES
from testbed.diagnosis.robot.kept_back_part import surely_more
from testbed.diagnosis.robot.motion_kinds import DRILL, SWAY, WALK
from testbed.diagnosis.robot.parameters import Found
from testbed.diagnosis.robot.probabilities import (
    NO_NAME,
    RobotSigns,
    calibration,
    distribution,
    leading,
    sort_of,
    tempered,
)
from testbed.diagnosis.robot.rig import through_amplifier
from testbed.effects import by_name
from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.recording.leg_model import Parameter
from testbed.recording.robot_model import RobotModelFile, read_robot_model
from testbed.scenario.scenario import load_scenario
from testbed.simulation.run import run_scenario
from testbed.workflows.diagnose import diagnose


def test_the_declared_play_holds_a_command_back_by_its_half_width() -> None:
    valve = build_machine().valve
    time = np.arange(2000) / 1000.0
    triangle = 0.1 * np.abs(((time / 0.5) % 2.0) - 1.0)
    out = through_amplifier(triangle, time, valve)
    half, lag = valve.hysteresis, 0.2 * valve.amplifier_lag_s
    rising = (time > 0.7) & (time < 0.95)
    np.testing.assert_allclose(triangle[rising] - out[rising], half + lag, atol=2.1e-4)


def test_a_run_too_short_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="too short"):
        check_duration(np.array([0.0, 0.9 * SHORTEST_S]), tmp_path)


def test_every_run_of_the_blind_test_hides_what_its_kind_says() -> None:
    runs = [drawn(seed) for seed in range(3 * len(KINDS))]
    assert {run.motion for run in runs} == set(MOTIONS)
    for run in runs:
        count = {"clean": 0, "double": 2}.get(run.kind, 1)
        assert len(run.truth) == len(set(run.truth)) == count
        tolerances = [by_name(h["effect"]).is_tolerance for h in run.hidden]
        if run.kind in ("single", "double"):
            assert not any(tolerances)


def run_trial(seed: int, truth: list[str], said: list[str], factor: float) -> dict[str, Any]:
    """A trial as the blind test keeps it."""
    verdict = "effect" if said else "none"
    hypotheses = [{"names": said, "probability": 0.9}, {"names": ["unnamed"], "probability": 0.1}]
    hidden = [{"effect": "sensor.gain_a", "at": "fl_vertical", "parameters": {"gain_error": 0.1}}]
    interval = {"gain_error": {"value": 0.1, "unit": "1", "interval90": [0.08, 0.12]}}
    effect = {"name": "sensor.gain_a", "place": "fl_vertical", "parameters": interval}
    return {
        "seed": seed,
        "motion": "stand",
        "kind": "single" if truth else "clean",
        "truth": truth,
        "hidden": hidden if truth else [],
        "visible": truth,
        "verdict": verdict,
        "names": said,
        "effects": [effect | {"ambiguous_with": []}] if said else [],
        "hypotheses": hypotheses,
        "signs": {"motions": [SWAY], "sets": [[["sensor.gain_a@fl_vertical"], factor, None]]},
        "width": 2.0,
        "second": {},
        "closed": {"before": 300.0, "after": 200.0, "told": 100.0, "sound": 100.0} if said else {},
        "seconds": 1.0,
    }


GAIN = ["sensor.gain_a@fl_vertical"]
FRICTION = ("friction.pressure@fl_rotation",)


def test_scores_count_names_places_intervals_and_what_is_closed() -> None:
    found = scores([run_trial(1, GAIN, GAIN, 90.0), run_trial(2, [], [], 1.0)])
    assert found["name_and_place"]["share"] == found["place_named"]["share"] == 1.0
    assert found["clean_none"]["share"] == 1.0 and found["intervals"]["share"] == 1.0
    assert found["closed_share"]["p50"] == pytest.approx((9 - 4) / (9 - 1))
    wrong = scores([run_trial(1, GAIN, ["sensor.gain_b@fl_vertical"], 90.0)])
    assert wrong["place_named"]["share"] == 1.0 and wrong["name_and_place"]["share"] == 0.0


@pytest.mark.parametrize(
    ("before", "after", "told", "worse", "harmed", "truly"),
    [
        (300.0, 320.0, 330.0, 1, 0, 1),
        (300.0, 320.0, 300.0, 1, 1, 0),
        (300.0, 310.0, 200.0, 0, 0, 0),
        (300.0, 300.0, 320.0, 0, 0, 1),
    ],
)
def test_what_the_truth_makes_worse_is_told_apart_from_harm(
    before: float, after: float, told: float, worse: int, harmed: int, truly: int
) -> None:
    closed = {"before": before, "after": after, "told": told, "sound": 100.0}
    found = scores([run_trial(1, GAIN, GAIN, 90.0) | {"closed": closed}])
    assert found["made_worse"]["share"] == worse
    assert found["made_worse_than_by_the_truth"]["share"] == harmed
    assert found["made_worse_by_the_truth"]["share"] == truly


SURE = Verdict("effect", cast(Any, None), ((("sensor.gain_a@fl_vertical",), 1.0),), {})


@pytest.mark.parametrize(
    ("rivals", "believed"),
    [
        ({}, True),
        ({"sensor.gain_b@fl_vertical": 0.4}, True),
        ({"sensor.gain_a@fr_vertical": 0.1, "sensor.gain_b@fl_vertical": 0.4}, True),
        ({"sensor.gain_a@fr_vertical": 0.15}, True),
        ({"sensor.gain_a@fr_vertical": 0.25}, False),
        ({"sensor.gain_a@fr_vertical": 0.15, "sensor.gain_a@rl_vertical": 0.15}, False),
    ],
)
def test_forces_are_corrected_where_the_place_of_what_was_found_is_likely(
    rivals: dict[str, float], believed: bool
) -> None:
    found = Found("sensor.gain_a", "fl_vertical", {"gain_error": Parameter(value=0.1, unit="1")})
    errors = {FORCES: {"before": 1.0, "refit": 1.0, "after": 0.9}}
    rest = 1.0 - sum(rivals.values())
    sets = ((("sensor.gain_a@fl_vertical",), rest), *(((n,), p) for n, p in rivals.items()))
    nothing: Any = None
    told = Verdict("effect", nothing, sets, {})
    said = RobotDiagnosis("run", nothing, nothing, told, (found,), errors, {})
    assert len(models(said, RobotModelFile())["after"].effects) == believed
    assert as_json(said).get("not_believed") == (None if believed else PLACE_IN_DOUBT)


def test_of_two_effects_the_one_that_is_sure_is_believed_by_itself() -> None:
    gain = Found("sensor.gain_a", "fl_vertical", {"gain_error": Parameter(value=0.1, unit="1")})
    alone = replace(gain, parameters={"gain_error": Parameter(value=0.12, unit="1")})
    rope = Found("rope.stiffness", "rope", {"factor": Parameter(value=0.6, unit="1")})
    errors = {FORCES: {"before": 1.0, "refit": 1.0, "after": 0.9}}
    nothing: Any = None
    both = (gain.name, rope.name)
    for doubt, believed in ((0.25, (alone,)), (0.1, (gain, rope))):
        told = Verdict("effect", nothing, ((both, 1.0 - doubt), ((gain.name,), doubt)), {})
        said = RobotDiagnosis(
            "run", nothing, nothing, told, (gain, rope), errors, {}, without_doubts=(alone,)
        )
        assert said.believed == believed and said.place_is_likely(rope) == (doubt < 0.2)
        (effect, *_) = models(said, RobotModelFile())["after"].effects
        assert effect.parameters["gain_error"].value == (0.12 if doubt > 0.2 else 0.1)
        assert [e["believed"] for e in as_json(said)["effects"]] == [True, doubt < 0.2]


@pytest.mark.parametrize(
    ("before", "after", "believed"),
    [(1.0, 0.9, 1), (1.0, 1.0, 1), (1.0, 1.01, 1), (1.0, 1.03, 0), (6.0, 1.03, 1), (6.0, 1.06, 0)],
)
def test_what_predicts_forces_worse_is_said_but_not_believed(
    before: float, after: float, believed: int
) -> None:
    found = Found("sensor.gain_a", "fl_vertical", {"gain_error": Parameter(value=0.1, unit="1")})
    errors = {FORCES: {"before": before, "refit": 1.0, "after": after}}
    nothing: Any = None
    said = RobotDiagnosis("run", nothing, nothing, SURE, (found,), errors, {})
    assert len(models(said, RobotModelFile())["after"].effects) == believed


def test_what_one_second_alone_foretells_worse_may_be_chance() -> None:
    found = Found("sensor.gain_a", "fl_vertical", {"gain_error": Parameter(value=0.1, unit="1")})
    errors = {FORCES: {"before": 1.0, "refit": 1.0, "after": 1.1}}
    nothing: Any = None
    one, each = np.array([2.0, -0.3, 0.1, -0.2, 0.0]), np.array([0.4, 0.3, 0.2, 0.4, 0.3])
    assert not surely_more(one) and surely_more(each) and surely_more(each[:2])
    for added, believed in ((one, 1), (each, 0)):
        said = RobotDiagnosis("run", nothing, nothing, SURE, (found,), errors, {}, added_n2=added)
        assert len(models(said, RobotModelFile())["after"].effects) == believed


@pytest.mark.parametrize(("after", "believed"), [(1.01, True), (1.03, False)])
def test_a_summary_says_where_what_was_found_is_not_in_the_model(
    after: float, believed: bool
) -> None:
    found = Found("sensor.gain_a", "fl_vertical", {"gain_error": Parameter(value=0.1, unit="1")})
    errors = {FORCES: {"before": 1.0, "refit": 1.0, "after": after}}
    sets = ((("sensor.gain_a@fl_vertical",), 1.0),)
    nothing: Any = None
    told = Verdict("effect", nothing, sets, {})
    said = RobotDiagnosis("run", nothing, nothing, told, (found,), errors, {})
    rows = [row[0] for row in summary_rows(said)[1]]
    assert summary_rows(said)[1][0] == ["verdict", "effect", "probability 1.000"]
    assert ("model.yaml" not in rows) == believed == as_json(said)["believed"]


@pytest.mark.parametrize(("kind", "expected"), [("none", 0.2), ("unnamed", 0.1), ("effect", 0.7)])
def test_a_verdict_is_as_probable_as_all_sets_of_its_kind(kind: str, expected: float) -> None:
    sets = ((("a@x",), 0.4), (("b@y",), 0.3), ((), 0.2), (NO_NAME, 0.1))
    nothing: Any = None
    assert Verdict(kind, nothing, sets, {}).probability_of_kind == pytest.approx(expected)


def test_a_run_without_ropes_is_said_to_be_unlike_those_that_were_tried() -> None:
    """Its load pins read some newtons all the same; feet of a machine that hangs bear less."""

    def balances(*tensions_n: float) -> Any:
        foot_force = np.tile([0.0, 0.0, 1e4], (5, 4, 1))
        bodies = [
            SimpleNamespace(
                seen=SimpleNamespace(tension_n=np.full((5, 2), n)), foot_force=foot_force
            )
            for n in tensions_n
        ]
        return SimpleNamespace(bodies=bodies)

    assert beyond_what_was_tried(balances(12e3)) == ""
    assert beyond_what_was_tried(balances(100.0)) == NO_ROPES
    assert beyond_what_was_tried(balances(12e3, 100.0)) == NO_ROPES
    nothing: Any = None
    told = Verdict("none", nothing, (((), 1.0),), {})
    said = RobotDiagnosis("run", nothing, nothing, told, (), {FORCES: {}}, {}, beyond=NO_ROPES)
    assert as_json(said)["beyond"] == NO_ROPES
    assert ["beyond what was tried", "", NO_ROPES] in summary_rows(said)[1]


def test_few_runs_of_a_perfect_diagnosis_are_off_by_chance() -> None:
    def off(runs: int, stated: float) -> float:
        said = {"hypotheses": [{"names": [], "probability": stated}]}
        told = {"kind": "clean", "visible": [], "names": [], "truth": []}
        found = calibration_of_stated([{**told, **said}] * runs)
        return float(found["error_of_a_perfect_one"])

    for runs in (25, 400):  # of a binomial share: the mean size of what is about normal
        assert off(runs, 0.8) == pytest.approx(0.4 * np.sqrt(2.0 / np.pi / runs), rel=0.1)
    assert off(25, 1.0) == 0.0


def test_what_no_belief_can_close_is_told_apart_from_what_it_could() -> None:
    trial = run_trial(1, GAIN, GAIN, 90.0)
    oil = trial | {"closed": {"before": 300.0, "after": 300.0, "told": 300.0, "sound": 100.0}}
    found = scores([trial | {"closed": trial["closed"] | {"told": 150.0}}, oil])
    assert found["closed_share"]["of"] == 2 and found["closed_of_closable"]["of"] == 1
    assert found["closed_of_closable"]["p50"] == pytest.approx((9 - 4) / (9 - 2.25))


@pytest.mark.parametrize("right", [12, 20])
def test_a_name_is_stated_no_surer_than_names_have_been_right(right: int) -> None:
    other = ["friction.load@fl_vertical"]
    trials = [run_trial(k, GAIN if k < right else other, GAIN, 60.0 + k) for k in range(20)]
    trials += [run_trial(20 + k, [], [], 5.0 + 0.2 * k) for k in range(20)]
    said = [t for t in restated(trials, fit(trials)) if t["names"]]
    stated = [t["hypotheses"][0]["probability"] for t in said]
    assert len(said) == 20 and np.mean(stated) == pytest.approx(right / 20, abs=0.03)


def test_what_sound_machines_reach_may_stay_as_more_runs_told_it() -> None:
    trials = [run_trial(k, GAIN, GAIN, 60.0 + k) for k in range(20)]
    trials += [run_trial(20 + k, [], [], 5.0 + 0.2 * k) for k in range(20)]
    known = {SWAY: {sort_of(GAIN[0]): 11.5}}
    kept, own = fit(trials, known), fit(trials)
    assert kept["sound"] == known and own["sound"] != known
    assert set(kept) == set(own)


def test_evidence_counts_less_and_less() -> None:
    counted = tempered(np.array([-5.0, 0.1, 10.0, 1000.0]), 20.0)
    np.testing.assert_allclose(counted[:2], [-5.0, 0.1], rtol=3e-3)
    np.testing.assert_allclose(counted[2:], [20.0 * np.log(1.5), 20.0 * np.log(51.0)])


@pytest.mark.parametrize(("any_course", "verdict"), [(38.0, FRICTION), (160.0, NO_NAME)])
def test_a_name_that_leaves_much_to_an_error_of_any_course_is_none(
    any_course: float, verdict: tuple[str, ...]
) -> None:
    tried = ((FRICTION, 40.0), (("unnamed.force@fl_rotation",), any_course))
    assert leading(distribution(RobotSigns(tried), calibration())) == verdict


def test_fitted_numbers_tell_strong_evidence_from_weak() -> None:
    trials = [run_trial(k, GAIN, GAIN, 60.0 + k) for k in range(20)]
    trials += [run_trial(20 + k, [], [], 5.0 + 0.2 * k) for k in range(20)]
    for trial in restated(trials, fit(trials)):
        assert (trial["verdict"] == "effect") == bool(trial["truth"])


def test_what_is_hidden_and_not_visible_may_be_named_or_not() -> None:
    both = run_trial(1, GAIN, GAIN, 90.0) | {"truth": [*GAIN, "rope.stiffness@rope"]}
    assert target(both) == frozenset(GAIN)
    assert target(both | {"names": both["truth"]}) == frozenset(both["truth"])
    assert target(both | {"names": [*GAIN, "robot.payload@body"]}) == frozenset(GAIN)
    assert scores([both])["name_and_place"]["share"] == 1.0


def test_a_second_motion_is_scored_beside_what_was_said_without_it() -> None:
    second = {"motion": "rise", "visible": GAIN, "verdict": "effect", "names": GAIN}
    close = run_trial(1, GAIN, [], 20.0) | {"second": second}
    found = scores([close, run_trial(2, GAIN, GAIN, 90.0)])["second"]
    assert found["cases"] == 1 and found["motions"] == {"rise": 1}
    assert found["without"]["share"] == 0.0 and found["with"]["share"] == 1.0


def test_what_sound_machines_reach_counts_for_nothing_at_joints_of_the_sort() -> None:
    trials = [run_trial(k, [], [], 12.0 + 0.1 * k) for k in range(20)]
    found = fit(trials)["sound"]
    sound = found[SWAY]
    assert found[WALK] == found[DRILL] == {}
    assert 13.0 < sound[sort_of(GAIN[0])] < 14.0
    joint = GAIN[0].rpartition("_")[2]
    assert {k for k in sound if k.startswith("sensor.gain_a")} == {f"sensor.gain_a@{joint}"}
    assert sort_of("rope.direction@rope_left") == "rope.direction"


@pytest.mark.parametrize("width", [2.0, 4.0])
def test_the_width_of_intervals_is_fitted_to_the_linear_model_whatever_was_stated(
    width: float,
) -> None:
    trial = run_trial(1, GAIN, GAIN, 60.0)
    interval = [0.08 - 0.01 * width, 0.08 + 0.01 * width]
    effect = trial["effects"][0] | {"parameters": {"gain_error": {"value": 0.08}}}
    effect["parameters"]["gain_error"]["interval90"] = interval
    found = fitted_doubt([trial | {"effects": [effect], "width": width}])
    assert found.width == pytest.approx((0.1 - 0.08) / 0.01)
    assert not found.law


def test_a_law_that_is_wrong_widens_its_own_number_alone() -> None:
    """Six gains that came out a quarter too small, and a hundred payloads that did not."""
    interval = {"value": 0.08, "interval90": [0.077, 0.083]}
    wrong = {
        "name": "sensor.gain_a",
        "place": "fl_vertical",
        "parameters": {"gain_error": interval},
    }
    right = {"value": 100.0, "interval90": [90.0, 110.0]}
    weight = {"name": "robot.payload", "place": "body", "parameters": {"mass": right}}
    hidden = [
        {"effect": "sensor.gain_a", "at": "fl_vertical", "parameters": {"gain_error": 0.1}},
        {"effect": "robot.payload", "at": "body", "parameters": {"mass": 101.0}},
    ]
    trial = run_trial(1, GAIN, GAIN, 60.0) | {"effects": [wrong, weight], "hidden": hidden}
    trial["width"] = 1.0
    others = [trial | {"effects": [weight], "seed": seed} for seed in range(6, 100)]
    found = fitted_doubt([*(trial | {"seed": seed} for seed in range(6)), *others])
    assert found.law == {"sensor.gain_a.gain_error": pytest.approx(0.24, abs=0.02)}
    assert found.width == 1.0
    ends = found.ends("sensor.gain_a", "gain_error", 0.08, (0.077, 0.083))
    assert ends[0] < 0.062 and ends[1] == pytest.approx(0.1, abs=0.002)
    assert found.ends("robot.payload", "mass", 100.0, (90.0, 110.0)) == (90.0, 110.0)
    again = trial | {"effects": [stated(wrong, ends), weight], "law": found.law}
    assert fitted_doubt([*(again | {"seed": s} for s in range(6)), *others]).law == found.law
    assert not fitted_doubt([*[again] * 6, *others]).law  # one run, however often diagnosed


def stated(effect: dict[str, Any], ends: tuple[float, float]) -> dict[str, Any]:
    """The gain with another interval."""
    return effect | {"parameters": {"gain_error": {"value": 0.08, "interval90": list(ends)}}}


def test_kept_trials_are_read_by_the_harness(tmp_path: Path) -> None:
    test = RobotBlindTest(runs=1, first_seed=7)
    assert list(test.cases()) == ["7"] and not (tmp_path / LINES).exists()


def entry(effect: str, at: str, **parameters: float) -> dict[str, Any]:
    """An entry of a scenario's `undeclared`."""
    return {"effect": effect, "at": at, "parameters": parameters}


@pytest.mark.slow
def test_a_hidden_rope_direction_is_named_with_its_size(tmp_path: Path) -> None:
    hidden = [entry("rope.direction", "rope_left", azimuth=0.15, elevation=0.1)]
    scenario = load_scenario("stand_clean", [f"undeclared={json.dumps(hidden)}"], 3, 14.0)
    run_scenario(scenario, tmp_path / "run")
    found = diagnose(tmp_path / "run", tmp_path / "found").tree
    assert found["format"] == FORMAT and found["verdict"] == "effect"
    told = {e["place"]: e for e in found["effects"]}
    assert told["rope_left"]["name"] == "rope.direction"
    low, high = told["rope_left"]["parameters"]["azimuth"]["interval90"]
    assert low < 0.15 < high
    assert sum(h["probability"] for h in found["hypotheses"]) == pytest.approx(1.0)
    model = read_robot_model(tmp_path / "found" / "model.yaml")
    assert {e.place for e in model.effects} == set(told)


@pytest.mark.slow
def test_a_sound_robot_is_left_alone(tmp_path: Path) -> None:
    run_scenario(load_scenario("stand_clean", [], 5, 12.0), tmp_path / "run")
    found = diagnose(tmp_path / "run", tmp_path / "found").tree
    assert found["verdict"] == "none" and found["effects"] == []
