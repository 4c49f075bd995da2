"""The contact-loss benchmark counts what is there, by the load of the foot; its floor is one; its
JSON is complete.
"""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from testbed.benchmarks.contact_loss import bounds
from testbed.benchmarks.contact_loss.benchmark import Commissioned, ContactLoss
from testbed.benchmarks.contact_loss.page import page
from testbed.benchmarks.contact_loss.rivals import (
    COMPARED,
    published,
    rivals,
    shipped_thresholds,
)
from testbed.benchmarks.contact_loss.scenes import (
    GROUP,
    MACHINES,
    Scene,
    _undeclared,
    draw,
    scenes,
)
from testbed.benchmarks.contact_loss.score import CLASSES, Reference, raised, scored
from testbed.benchmarks.contact_loss.summary import (
    COMMISSIONED,
    Followed,
    by_machine,
    summarise,
    tables,
    tuned,
)
from testbed.benchmarks.contact_loss.warning import CURVE_N
from testbed.benchmarks.harness import code, poisson, wilson
from testbed.cli import main
from testbed.errors import InputError
from testbed.estimation.contact_losses import LossRule
from testbed.estimation.detectors.base import DROP, Hold
from testbed.estimation.detectors.table import BEST
from testbed.machine.build import build_machine
from testbed.machine.names import AXES, VERTICAL
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation
from testbed.world.undeclared import hidden_beside

DT, RULE = 1e-3, LossRule(10_000.0)


def _normal(*parts: tuple[float, float, float]) -> np.ndarray:
    """Foot 0 goes through (seconds, from N, to N) in turn, the others bear 5 kN."""
    foot = np.concatenate([np.linspace(a, b, round(s / DT)) for s, a, b in parts])
    out = np.full((len(foot), 4), 5000.0)
    out[:, 0] = foot
    return out


def _reference(normal: np.ndarray) -> Reference:
    meant = np.ones(normal.shape, dtype=bool)
    return Reference.of(normal, meant, np.arange(len(normal)) * DT, RULE)


@pytest.mark.parametrize(
    ("bore", "word"), [(5000.0, "loaded"), (1600.0, "loaded"), (1500.0, "light"), (500.0, "near")]
)
def test_a_loss_is_classed_by_what_the_foot_bore(bore: float, word: str) -> None:
    (loss,) = _reference(_normal((3, bore, bore), (0.1, 0, 0), (1, bore, bore))).losses
    assert CLASSES[loss.load_class] == word
    assert (loss.start_s, loss.end_s) == pytest.approx((3.0, 3.1))
    assert not loss.gradual and not loss.meant


def test_a_slow_loss_is_gradual() -> None:
    (loss,) = _reference(_normal((3, 5000, 5000), (1, 5000, 0), (0.2, 0, 0))).losses
    assert loss.gradual and loss.fell_s == pytest.approx(0.47, abs=0.03)


def test_time_in_contact_is_classed_by_the_lowest_load_within_half_a_second() -> None:
    off = _reference(_normal((3, 5000, 5000), (0.01, 1000, 1000), (3, 5000, 5000)))
    carried = dict(zip(CLASSES, off.facts()["carried_s"], strict=True))
    assert carried["light"] == pytest.approx(1.01) and carried["near"] == 0.0
    assert carried["loaded"] == pytest.approx(4 * 6.01 - 1.01)


def test_one_pass_counts_at_every_threshold() -> None:
    """Alarms: one 2 s early (false), one 10 ms late; back 50 ms after the touchdown, and 20 ms of
    dwell.
    """
    off = _reference(_normal((3, 5000, 5000), (0.3, 0, 0), (2, 5000, 5000)))
    score = np.zeros((len(off.time_s), 4))
    score[1000:1010, 0], score[3010:3350, 0], score[3100, 0] = 1.0, 2.0, 3.0
    low, middle, high, never = scored(score, np.array([1.0, 2.0, 3.0, 4.0]), off, DROP)
    assert low["delays_s"] == middle["delays_s"] == [0.01] and high["delays_s"] == [0.1]
    assert low["false_alarms"] == [0, 0, 1] and middle["false_alarms"] == [0, 0, 0]
    assert middle["touchdowns_s"] == pytest.approx([0.069]) and never["touchdowns_s"] == []
    assert never["delays_s"] == [None] and sum(never["missed_s"]) == pytest.approx(0.3)
    assert sum(middle["false_flight_s"]) == pytest.approx(0.069)


def test_a_higher_threshold_leaves_the_levels_of_a_loaded_foot_where_they_are() -> None:
    hold = Hold(margin=2.0, dwell_s=0.1, sure_margin=5.0, sure_s=0.01)
    higher, lower = raised(hold, 1.5), raised(hold, -3.0)
    assert (higher.margin, higher.sure_margin, higher.dwell_s) == (3.5, 6.5, 0.1)
    assert (lower.margin, lower.sure_margin) == (0.0, 2.0)
    assert raised(replace(hold, slow_margin=1.0), 1.5).slow_margin == 2.5
    assert raised(DROP, 1.5) == DROP
    off = _reference(_normal((3, 5000, 5000), (0.3, 0, 0), (2, 5000, 5000)))
    score = np.full((len(off.time_s), 4), -6.0)
    score[3010:3310, 0], score[3310:4000, 0] = 4.0, -1.5  # loaded again below 1, not below -2
    own, alone = (
        scored(score, np.array([0.0, 3.0]), off, hold, first)[1] for first in (True, False)
    )
    assert sum(own["false_flight_s"]) == pytest.approx(0.709)
    assert sum(alone["false_flight_s"]) == pytest.approx(0.109)


def test_the_limit_s_sets_hold_the_truth_and_four_feet_know_more_than_one() -> None:
    rng = np.random.default_rng(4)
    load, width = rng.uniform(0.0, 9000.0, (500, 4)), np.array([700.0, 900.0, 1100.0, 600.0])
    middle = load + rng.uniform(-1.0, 1.0, (500, 4)) * width
    low, high = np.maximum(middle - width, 0.0), middle + width
    twist = bounds.internal_modes(np.zeros((500, 12)))
    assert twist.sum(axis=1) == pytest.approx(0.0, abs=1e-9)
    assert np.sign(twist[0]).tolist() in ([1, -1, -1, 1], [-1, 1, 1, -1])
    below, above = bounds.balanced(low, high, load, twist)
    assert (below <= load + 1e-6).all() and (above >= load - 1e-6).all()
    assert (below >= low - 1e-6).all() and (above <= high + 1e-6).all()
    assert (above - below).mean() < 0.6 * (high - low).mean()


def _path(oil_degc: float, samples: int, *changes: str) -> bounds.SensorPath:
    """The sensors of the drawing-board machine in a run of drill_slope_45."""
    scenario = load_scenario("drill_slope_45", changes, 3)
    chamber_b = np.full((samples, 4), 3.0e6)
    return bounds.SensorPath.built(build_machine(), scenario, chamber_b, np.full(samples, oil_degc))


CALIBRATED_DEGC = build_machine().sensor.calibration_temperature_degc


def test_the_floor_finds_a_loss_at_once_and_is_not_taken_in_by_a_short_gap() -> None:
    normal = _normal((1, 5000, 5000), (0.008, 0, 0), (1, 5000, 5000), (0.5, 0, 0), (1, 5000, 5000))
    scores = bounds.floor_scores(normal, _path(CALIBRATED_DEGC, len(normal)), RULE, DT)
    (found,) = scored(
        scores, np.array([bounds.FLOOR_THRESHOLD]), _reference(normal), bounds.FLOOR_HOLD
    )
    assert found["false_alarms"] == [0, 0, 0]
    assert found["delays_s"] == pytest.approx([0.012], abs=0.004)


def test_the_floor_s_sensors_err_by_warmth_as_their_data_sheet_allows() -> None:
    force = np.full((4000, 4), 5000.0)
    warm = ("sensors.thermal_drift=true",)
    exact = _path(CALIBRATED_DEGC, len(force), "sensors.characteristic=false")
    cold = _path(CALIBRATED_DEGC - 20.0, len(force), *warm, "sensors.characteristic=false")
    bent = _path(CALIBRATED_DEGC, len(force))
    off = [
        np.abs((path.measured_n(force, DT) - force).mean(axis=0)) for path in (exact, cold, bent)
    ]
    assert np.all(off[0] < 3.0)
    largest = 0.0125 * 1.0e7 / 40.0 * 20.0 * cold.areas_m2.sum(axis=0)
    assert np.all(off[1] < largest) and off[1].max() > 0.05 * largest.max()
    assert 5.0 < off[2].max() < 1.5e4 * bent.areas_m2.sum(axis=0).max() + 100.0
    assert np.all(cold.error_n > bent.error_n)


def test_the_floor_gives_back_what_its_sensors_show_below_nothing() -> None:
    """A foot of 500 N whose sensors read 600 N too little is no lost one once it has hung."""
    normal = _normal((1, 5000, 5000), (1, 0, 0), (2, 500, 500))
    path = _path(CALIBRATED_DEGC, len(normal))
    path.transducers["zero"][0, 0] = -600.0 / path.areas_m2[0, 0]
    scores = bounds.floor_scores(normal, path, RULE, DT)
    assert np.all(scores[1100:2000, 0] > 0.0) and np.all(scores[2100:, 0] < 0.0)


@pytest.mark.slow
def test_the_floor_looks_through_the_run_s_own_transducers() -> None:
    scenario = draw(Scene("drill", "scoring", 2)).scenario
    simulation = Simulation(scenario)
    truth = simulation.machines.truth
    simulation.close()
    path = bounds.SensorPath.built(truth, scenario, np.zeros((1, 4)), np.zeros(1))
    there = simulation.machine.board["transducers"][:, list(VERTICAL)]
    for name in ("thermal", "thermal_gain", "bow", "hysteresis", "ripple", "ripple_phase"):
        assert np.array_equal(path.transducers[name], there[name]), name


def _answer(name: str, alarms: int, missed_s: float) -> dict[str, object]:
    row = {"delays_s": [], "touchdowns_s": [], "false_alarms": [0, 0, alarms]}
    row |= {"missed_s": [0.0, 0.0, missed_s], "false_flight_s": [0.0, 0.0, 0.0]}
    still = row | {"false_alarms": [0, 0, 0], "missed_s": [0.0, 0.0, 9.0]}
    scene = {"scene": {"kind": "drill"}, "slope_deg": 45.0, "drifting": 0, "losses": []}
    times = {"carried_s": [0.0, 0.0, 3500.0], "lost_s": [0.0, 0.0, 100.0]}
    return scene | times | {"detectors": {name: [row, still]}}


def test_a_threshold_is_set_for_the_least_cost_and_an_alarm_costs_half_a_second() -> None:
    cheap, dear = _answer("x", 10, 3.9), _answer("x", 10, 4.1)
    assert Followed.of([cheap], "x", 0).cost_s == pytest.approx(3.9 + 0.5 * 10)
    assert tuned([cheap], {"x": (1.0, 2.0)}) == {"x": 0}
    assert tuned([dear], {"x": (1.0, 2.0)}) == {"x": 1}


def test_intervals_against_tables() -> None:
    assert wilson(0, 0) is None and poisson(3, 0.0) is None
    assert wilson(8, 10) == pytest.approx([0.4902, 0.9433], abs=1e-4)
    assert wilson(500, 500) == pytest.approx([0.99237, 1.0], abs=1e-4)
    assert poisson(0, 1.0) == pytest.approx([0.0, 3.6889], abs=1e-4)
    assert poisson(10, 2.0) == pytest.approx([4.7954 / 2, 18.3904 / 2], abs=1e-4)


def test_losses_of_one_machine_are_no_losses_of_many() -> None:
    one_fails = [True] * 90 + [False] * 10
    apart = by_machine(one_fails, list(range(100)))
    together = by_machine(one_fails, [k // 10 for k in range(100)])
    assert apart == pytest.approx([0.84, 0.95], abs=0.02)
    assert together == pytest.approx([0.7, 1.0], abs=0.02)
    assert by_machine(one_fails, [7] * 100) is None and by_machine([], []) is None


def test_the_supervised_scene_is_its_twin_and_splits_never_meet() -> None:
    a, b = draw(Scene("drill", "scoring", 0)), draw(Scene("supervised", "scoring", 0))
    assert b.scenario.control.supervisor and not a.scenario.control.supervisor
    assert a.scenario.task == b.scenario.task and np.array_equal(a.moves_m, b.moves_m)
    assert a.scenario.machine == b.scenario.machine and a.scenario.machine.draw == "workshop"
    tuning, scoring = (scenes(split, 40.0) for split in ("tuning", "scoring"))
    assert not {s.seed for s in tuning} & {s.seed for s in scoring}
    assert not {s.machine_seed for s in tuning} & {s.machine_seed for s in scoring}


def test_a_group_of_scenes_shares_its_machines_and_each_of_them_drills_and_walks() -> None:
    every = scenes("scoring", 6.0)
    first = [s for s in every if s.number < GROUP]
    machines = {s.machine_seed for s in first}
    assert len(machines) == MACHINES["scoring"]
    assert machines == {s.machine_seed for s in first if s.kind == "crawl"}
    assert machines == {s.machine_seed for s in first if s.kind == "drill"}
    later = {s.machine_seed for s in every if GROUP <= s.number < 2 * GROUP}
    assert len(later) == len(machines) and not later & machines


def test_hours_are_those_of_single_feet() -> None:
    chosen = [s for s in scenes("scoring", 1.0) if s.kind != "supervised"]
    assert 3600.0 <= 4 * sum(s.duration_s - 2.0 for s in chosen) <= 3800.0
    assert {s.kind for s in chosen} == {"drill", "crawl"}


def test_up_to_three_effects_hide_anywhere_and_a_third_of_the_scenes_drift() -> None:
    drawn = [_undeclared(np.random.default_rng(k)) for k in range(600)]
    zeros = [[e for e in scene if e["effect"] == "sensor.zero_a"] for scene in drawn]
    others = [len(scene) - 2 * len(z) for scene, z in zip(drawn, zeros, strict=True)]
    assert set(others) == {0, 1, 2, 3}
    assert {e["at"] for scene in drawn for e in scene} == set(AXES)
    assert {len(z) for z in zeros} == {0, 2, 3}
    assert np.mean([bool(z) for z in zeros]) == pytest.approx(0.35, abs=0.06)


def test_no_scene_hides_the_same_effect_twice_at_a_place() -> None:
    for number in (132, 442):  # both draw one twice
        hidden = draw(Scene("drill", "tuning", number)).scenario.undeclared
        places = [(entry.effect, entry.at) for entry in hidden]
        assert len(set(places)) == len(places)
        hidden_beside((), hidden)


def test_every_rival_has_a_threshold() -> None:
    assert set(shipped_thresholds()) == set(rivals())
    assert all(np.isfinite(v) for v in shipped_thresholds().values())


@pytest.mark.parametrize("hours", [0.0, -1.0, float("nan"), 2000.0])
def test_hours_that_make_no_sense_are_refused(hours: float) -> None:
    with pytest.raises(InputError, match="--hours"):
        ContactLoss(hours)


def test_a_class_of_ones_own_brings_the_tuning_scenes_with_it(tmp_path: Path) -> None:
    own = f"{_mine(tmp_path)}:Mine"
    alone, beside = ContactLoss(0.002), ContactLoss(0.002, own=(own,))
    assert {case.split for case in alone.cases().values()} == {"scoring"}
    assert {case.split for case in beside.cases().values()} == {"tuning", "scoring"}
    case = next(iter(alone.cases().values()))
    before = beside.made_from(case)
    _mine(tmp_path).write_text("class Mine:\n    def update(self, sample):\n        return None\n")
    code.cache_clear()
    assert beside.made_from(case) != before
    with pytest.raises(InputError, match="has no such class"):
        ContactLoss(0.002, own=(f"{tmp_path / 'mine.py'}:Other",))


def _mine(folder: Path) -> Path:
    file = folder / "mine.py"
    file.write_text(
        "class Mine:\n    def update(self, sample):\n        return -sample.row.estimate.two_chamber\n"
    )
    return file


def test_machines_that_are_not_drawn_need_no_commissioning() -> None:
    with pytest.raises(InputError, match="--commission"):
        ContactLoss(0.002, draw=None, commission=True)


def test_a_machine_is_commissioned_once_for_all_of_its_scenes() -> None:
    """Its answer is taken over wherever the folder is, and is another machine's for another one."""
    here, there = (Commissioned(Path(name), "workshop", (2000, 2001)) for name in "ab")
    assert here.cases() == {"2000": 2000, "2001": 2001}
    assert here.mark(2000) == there.mark(2000) != here.mark(2001)


def test_a_scene_is_judged_with_both_beliefs_and_each_has_its_marks() -> None:
    """The detector misses a loss of the drawing board's belief and finds it with the other."""
    loss = {"load_class": 2, "gradual": True, "meant": False, "foot": 0, "start_s": 3.0}
    words = {"touchdowns_s": [], "false_alarms": [0, 0, 0]}
    words |= {"missed_s": [0.0, 0.0, 0.1], "false_flight_s": [0.0, 0.0, 0.0]}
    blind, seeing = words | {"delays_s": [None]}, words | {"delays_s": [0.01]}
    scene = {"scene": asdict(Scene("drill", "scoring", 0)), "slope_deg": 45.0}
    scene |= {"drifting": 0, "losses": [loss], "fault": "", "verdict": "stood"}
    scene |= {"carried_s": [0.0, 0.0, 3500.0], "lost_s": [0.0, 0.0, 100.0]}
    scene |= {"square": [[0.0, 0.0, 8e6], [0.0, 0.0, 50.0]]}
    quiet = {
        "own": WARNED,
        "unplanned": WARNED,
        "true": WARNED,
        "curve": {str(n): WARNED for n in CURVE_N},
    }
    names = {"floor": "", BEST: ""}
    scene |= {"detectors": {name: [blind] for name in names}, "warning": quiet}
    scene[COMMISSIONED] = {"detectors": {name: [seeing] for name in names}, "warning": quiet}
    result = summarise([scene], 1.0, dict.fromkeys(names, (1.0,)), dict.fromkeys(names, 0), names)
    assert [d["recall"] for d in result["detectors"]] == [0.0, 0.0]
    assert [d["recall"] for d in result[COMMISSIONED]["detectors"]] == [1.0, 1.0]
    assert result["load_error_n"] == {"near": None, "light": None, "loaded": 400.0}
    assert [t.title.endswith(", commissioned") for t in tables(result)] == [False, True]
    assert "Aims, for <i>learned</i>, commissioned" in page(result)
    short = published(result)
    assert [d["by_class"]["loaded"]["recall"] for d in short["detectors"]] == [0.0, 0.0]
    after = {d["name"]: d["by_class"]["loaded"]["recall"] for d in short[COMMISSIONED]["detectors"]}
    assert after == {BEST: 1.0}
    assert "curve" not in short["warning"] and "curve" in result["warning"]


WARNED = dict.fromkeys(("lost", "early", "near", "false", "late", "light", "light_lost"), 0) | {
    "leads_s": [0.5]
}


@pytest.mark.slow
def test_a_small_benchmark_writes_all_of_its_json_and_resumes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = f"{_mine(tmp_path)}:Mine"
    out = tmp_path / "out"
    call = ["testbed", "contact-loss", "--out", str(out), "--hours", "0.002", "--detector", own]
    monkeypatch.setattr("sys.argv", call)
    monkeypatch.setattr("testbed.benchmarks.contact_loss.scenes.LENGTH_S", LENGTHS_S)
    monkeypatch.setattr("testbed.benchmarks.contact_loss.benchmark.PILOTS", 1)
    for _ in range(2):
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == 0
    result = json.loads((out / "contact_loss.json").read_text())
    assert result["losses"] >= 1 and len(result["aims"]) >= 6
    wanted = {"name", "best", "recall", "recall_interval95", "false_alarms_per_hour"}
    wanted |= {"delay_median_s", "delay_p95_s", "delay_floor_s", "at_floor_budget", "by_class"}
    assert all(wanted <= set(d) and "curve" not in d for d in result["detectors"])
    assert {d["name"] for d in result["detectors"] if "by" in d} == set(COMPARED)
    assert sum(d["best"] for d in result["detectors"]) == 1
    by_name = {d["name"]: d for d in result["detectors"]}
    assert np.isfinite(by_name[own]["threshold"])
    assert "learned" in (out / "contact_loss.html").read_text()
    kept = list((out / "scenes").glob("tuning-*/truth.parquet"))
    assert len(kept) == len(list((out / "scenes").glob("scoring-*/truth.parquet"))) == 5


LENGTHS_S = {"drill": 5.0, "crawl": 5.0, "supervised": 5.0}


def test_rod_changes_leave_something_in_the_store_and_change_nothing_where_it_has_enough() -> None:
    """Four changes of this scene would take 165 kg off a store of 99 kg."""
    scenario = draw(Scene("drill", "tuning", 358)).scenario
    stored_kg = scenario.carried_kg + build_machine().rod_store_body.mass_kg
    assert scenario.taken_kg == pytest.approx(0.9 * stored_kg)
    enough = draw(Scene("drill", "tuning", 0)).scenario
    assert enough.taken_kg < enough.carried_kg + build_machine().rod_store_body.mass_kg
