"""The contact-loss benchmark counts what is there: losses, delays, windows, intervals; and its JSON is complete."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from testbed.benchmarks.contact_loss.thresholds import shipped_thresholds

from testbed.benchmarks.contact_loss.benchmark import ContactLoss
from testbed.benchmarks.contact_loss.scenes import Scene, draw, scenes
from testbed.benchmarks.contact_loss.score import delays_s, find_losses, score_scene
from testbed.benchmarks.contact_loss.summary import oracle_threshold
from testbed.benchmarks.marks import code
from testbed.benchmarks.statistics import poisson, wilson
from testbed.cli import main
from testbed.errors import InputError

DT = 1e-3


def _normal(*parts: tuple[float, float]) -> np.ndarray:
    """Foot 0 bears each (seconds, N) in turn, the others 5 kN."""
    foot = np.concatenate([np.full(round(s / DT), n) for s, n in parts])
    out = np.full((len(foot), 4), 5000.0)
    out[:, 0] = foot
    return out


def test_a_loss_is_20_ms_below_300_n_after_half_a_second_of_carrying() -> None:
    normal = _normal(
        (3, 5000), (0.019, 0), (1, 5000), (0.020, 299), (0.4, 5000), (0.1, 0), (1, 5000), (0.1, 301)
    )
    carrying = np.ones(normal.shape, dtype=bool)
    (loss,) = find_losses(normal, carrying, DT, 2.0)
    assert (loss.foot, loss.loaded) == (0, True)
    assert loss.start_s == pytest.approx(4.019) and loss.end_s == pytest.approx(4.039)
    assert find_losses(normal, ~carrying, DT, 2.0) == []
    assert find_losses(normal, carrying, DT, 5.0) == []


def test_a_gradual_loss_spends_a_tenth_of_a_second_below_a_fifth() -> None:
    ramp = np.concatenate([np.full(6000, 5000.0), np.linspace(5000.0, 0.0, 1000), np.zeros(100)])
    normal = np.full((len(ramp), 4), 5000.0)
    normal[:, 0] = ramp
    (loss,) = find_losses(normal, np.ones(normal.shape, dtype=bool), DT, 2.0)
    assert loss.gradual and loss.below_share_s == pytest.approx((1000.0 - 300.0) / 5000.0, abs=2e-3)


def test_delays_at_every_threshold_follow_from_one_pass() -> None:
    normal = _normal((6, 5000), (0.3, 0), (3, 5000))
    score = np.zeros(normal.shape, dtype=np.float32)
    score[6010:6100, 0], score[6050, 0] = 1.0, 2.0
    found = score_scene(normal, np.ones(normal.shape, dtype=bool), {"x": score}, DT, 2.0)
    assert delays_s(found.stairs["x"], 0.0) == pytest.approx([0.0])
    assert delays_s(found.stairs["x"], 1.0) == pytest.approx([0.010])
    assert delays_s(found.stairs["x"], 2.0) == pytest.approx([0.050])
    assert np.isnan(delays_s(found.stairs["x"], 2.1)).all()
    assert max(found.windows["x"]) == 0.0  # the alarm stood within the loss and its margins


def test_windows_leave_out_losses_with_half_a_second_before_and_a_second_after() -> None:
    normal = _normal((6, 5000), (0.3, 0), (3.7, 2000))
    found = score_scene(normal, np.ones(normal.shape, dtype=bool), {}, DT, 2.0)
    assert sum(found.window_s) == pytest.approx(3 * 8.0 + 8.0 - 0.5 - 0.3 - 1.0)
    assert sorted(set(found.window_low_n)) == [2000.0, 5000.0]


def test_intervals_against_tables() -> None:
    assert wilson(0, 0) is None and poisson(3, 0.0) is None
    assert wilson(8, 10) == pytest.approx([0.4902, 0.9433], abs=1e-4)
    assert wilson(500, 500) == pytest.approx([0.99237, 1.0], abs=1e-4)
    assert poisson(0, 1.0) == pytest.approx([0.0, 3.6889], abs=1e-4)
    assert poisson(10, 2.0) == pytest.approx([4.7954 / 2, 18.3904 / 2], abs=1e-4)


def test_the_oracle_calls_a_foot_at_300_n_lost_once_in_eight_hours() -> None:
    from scipy.stats import norm

    rate = norm.sf((300.0 + oracle_threshold()) / 37.0) * 1000.0 * 8.0 * 3600.0
    assert rate == pytest.approx(1.0, rel=1e-6)


def test_scenes_differ_by_seed_and_split_and_the_supervised_one_is_its_twin() -> None:
    a, b = draw(Scene("losses", "scoring", 0, 60.0)), draw(Scene("supervised", "scoring", 0, 60.0))
    assert b.scenario.control.supervisor and not a.scenario.control.supervisor
    assert a.scenario.task == b.scenario.task and np.array_equal(a.moves_m, b.moves_m)
    assert draw(Scene("losses", "scoring", 1, 60.0)).scenario.terrain != a.scenario.terrain
    assert {s.seed for s in scenes("tuning", 8.0)}.isdisjoint(
        s.seed for s in scenes("scoring", 8.0)
    )


def test_eight_hours_are_at_least_eight_hours_of_quiet_drilling() -> None:
    quiet = [s for s in scenes("scoring", 8.0) if s.kind == "quiet"]
    assert sum(s.duration_s - 2.0 for s in quiet) >= 8 * 3600.0


def test_every_detector_has_a_shipped_threshold() -> None:
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


@pytest.mark.slow
def test_a_small_benchmark_writes_all_of_its_json(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = f"{_mine(tmp_path)}:Mine"
    monkeypatch.setattr("testbed.benchmarks.contact_loss.scenes.LOSS_SCENE_S", 24.0)
    monkeypatch.setattr(
        "sys.argv",
        ["testbed", "contact-loss", "--out", str(tmp_path), "--hours", "0.002", "--detector", own],
    )
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    result = json.loads((tmp_path / "contact_loss.json").read_text())
    assert result["hours"] == 0.002 and result["losses"] >= 1
    wanted = {
        "name",
        "best",
        "recall",
        "recall_interval95",
        "false_alarms_per_hour",
        "delay_median_s",
        "delay_p95_s",
        "delay_floor_s",
        "curve",
    }
    assert (
        all(wanted <= set(d) for d in result["detectors"])
        and sum(d["best"] for d in result["detectors"]) == 1
    )
    by_name = {d["name"]: d for d in result["detectors"]}
    assert np.isfinite(by_name[own]["threshold"])
    assert by_name[own]["curve"] == by_name["threshold_two_chamber"]["curve"]
    recalls = [row[2] for row in result["detectors"][0]["curve"]]
    assert recalls == sorted(recalls)
    assert "combined" in (tmp_path / "contact_loss.html").read_text()
