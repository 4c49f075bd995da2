"""Numbers of a run against hand-computed ones."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic_run import RMS_N, synthetic_columns

from testbed.estimation.contact_losses import LossRule
from testbed.machine.names import LEGS
from testbed.scenario.events import Bound, Expect
from testbed.simulation import metrics
from testbed.simulation.residuals import (
    Suspect,
    beyond_friction,
    load_residuals,
    odd_one_out,
    residual_summary,
    suspect,
)
from testbed.simulation.run_summary import unmet

T = np.arange(1000) / 1000.0
RULE = LossRule(10_000.0)


def _truth(**normal: np.ndarray) -> dict[str, np.ndarray]:
    return {
        "t": T,
        **{f"contact_normal_{leg}": normal.get(leg, np.full(1000, 5000.0)) for leg in LEGS},
    }


def _gap(start: int, end: int) -> np.ndarray:
    force = np.full(1000, 5000.0)
    force[start:end] = 0.0
    return force


def test_the_surprise_of_a_run_is_its_last_and_that_of_a_recording_without_it_is_none() -> None:
    assert metrics.surprise({"own_surprise": np.array([1.0, 5.0, 2.5])}) == 2.5
    assert metrics.surprise({}) == metrics.surprise({"own_surprise": np.array([])}) == 1.0


def test_rms_of_a_sine_is_its_amplitude_over_root_two() -> None:
    data, truth = synthetic_columns(20.0)
    found = metrics.force_rms_n(data, truth)
    assert list(found) == list(RMS_N)
    for method, value in RMS_N.items():
        assert found[method] == pytest.approx(value, rel=0.05)


def test_a_loss_of_19_ms_is_a_bounce_and_one_of_20_ms_is_a_loss() -> None:
    assert metrics.contact_losses({}, _truth(fr=_gap(100, 119)), RULE) == []
    (loss,) = metrics.contact_losses({}, _truth(fr=_gap(100, 120)), RULE)
    assert (loss.leg, loss.start_s, loss.end_s, loss.meant, loss.delay_s) == (
        "fr",
        0.1,
        0.119,
        False,
        None,
    )


def test_a_run_that_states_another_share_and_time_counts_other_losses() -> None:
    half = np.full(1000, 5000.0)
    half[100:200] = 2000.0
    assert metrics.contact_losses({}, _truth(fr=half), RULE) == []
    stated = LossRule(10_000.0, share=0.3, shortest_s=0.1)
    (loss,) = metrics.contact_losses({}, _truth(fr=half), stated)
    assert loss.start_s == pytest.approx(0.1)
    assert metrics.contact_losses({}, _truth(fr=half), LossRule(10_000.0, 0.3, 0.101)) == []


def test_the_delay_runs_from_the_true_loss_to_the_detectors_word() -> None:
    word = np.ones(1000)
    word[137:200] = 0.0
    (loss,) = metrics.contact_losses({"contact_rl": word}, _truth(rl=_gap(100, 200)), RULE)
    assert loss.delay_s == pytest.approx(0.037)
    (score,) = metrics.state_scores({"contact_rl": word}, _truth(rl=_gap(100, 200)), RULE).values()
    assert (score.false_alarms, score.missed_s) == (0, pytest.approx(0.037))


def test_a_word_without_a_loss_is_a_false_alarm() -> None:
    word = np.ones(1000)
    word[:20] = 0.0  # not yet spoken
    word[300:310] = 0.0
    word[700:701] = 0.0
    scores = metrics.state_scores({"contact_rl": word}, _truth(), RULE)
    assert scores["rl"].false_alarms == 2
    assert metrics.detector_summary([], scores, 0.5)["false_alarms_per_hour"] == 4.0


def test_a_swing_is_meant() -> None:
    carry = np.ones(1000)
    carry[95:210] = 0.0
    (loss,) = metrics.contact_losses({"carrying_fl": carry}, _truth(fl=_gap(100, 200)), RULE)
    assert loss.meant


@pytest.mark.parametrize(
    ("loads", "margin"),
    [
        ((5, 5, 5, 5), 0.5),
        ((1, 1, 4, 4), 0.2),
        ((0, 4, 4, 2), 0.2),
        ((0, 0, 5, 5), 0.0),
        ((4, 1, 4, 1), 0.2),
    ],
)
def test_the_stability_margin_is_the_load_off_the_tipping_edge(
    loads: tuple[float, ...], margin: float
) -> None:
    truth = {
        f"contact_normal_{leg}": np.full(3, 1000.0 * n) for leg, n in zip(LEGS, loads, strict=True)
    }
    truth["t"] = np.arange(3) / 1000.0
    assert metrics.stability_margin(truth, RULE.force_n)[-1] == pytest.approx(margin)


def test_the_margin_looks_at_a_tenth_of_a_second() -> None:
    margin = metrics.stability_margin(_truth(fl=_gap(500, 550), fr=_gap(500, 550)), RULE.force_n)
    assert margin[549] == pytest.approx(
        1 / 3
    )  # two of four feet at half their load on average: 5 / 15
    assert margin[499] == pytest.approx(0.5) and margin[650] == pytest.approx(0.5)


def test_the_tilt_of_a_body_flat_on_the_slope_is_zero_and_off_by_the_error_else() -> None:
    _, truth = synthetic_columns(1.0)
    assert metrics.tilt_deg(truth, 45.0).max() == pytest.approx(0.0, abs=1e-6)
    assert metrics.tilt_deg(truth, 40.0).max() == pytest.approx(5.0, abs=1e-6)


def test_the_way_up_the_slope_counts_along_it() -> None:
    truth = {
        f"body_pose_in_world_{i}": np.array([0.0, v])
        for i, v in zip("xyz", (3.0, 9.0, 4.0), strict=True)
    }
    assert metrics.climbed_m(truth, np.rad2deg(np.arctan2(4.0, 3.0))) == pytest.approx(5.0)


def test_rope_tension_is_the_length_of_its_force() -> None:
    truth = {
        f"rope_force_in_world_left_{i}": np.array([v])
        for i, v in zip("xyz", (3.0, 0.0, 4.0), strict=True)
    }
    assert metrics.rope_tension_n(truth, "left")[0] == pytest.approx(5.0)


@pytest.mark.parametrize("leg", LEGS)
@pytest.mark.parametrize("open_n", [0.0, 2000.0, -3000.0])
def test_one_wrong_leg_is_named_whatever_the_open_combination_does(leg: str, open_n: float) -> None:
    residuals = dict(zip(LEGS, (open_n, -open_n, -open_n, open_n), strict=True))
    residuals[leg] += 600.0
    found = suspect(residuals, dict.fromkeys(LEGS, 6000.0))
    assert found is not None
    assert (found.leg, found.error_n, found.share) == (
        leg,
        pytest.approx(600.0),
        pytest.approx(0.1),
    )


@pytest.mark.parametrize(
    "residuals", [(100, 0, 0, 0), (900, 900, 900, 900), (800, -800, -800, 800), (900, 900, 0, 0)]
)
def test_nobody_is_named_for_small_common_or_open_residuals(residuals: tuple[float, ...]) -> None:
    assert (
        suspect(dict(zip(LEGS, map(float, residuals), strict=True)), dict.fromkeys(LEGS, 6000.0))
        is None
    )


def test_a_load_that_friction_can_explain_accuses_nobody() -> None:
    data = {f"expected_{leg}": np.array([5000.0, 5700.0, 4000.0]) for leg in LEGS}
    data |= {f"own_low_{leg}": np.full(3, 4500.0) for leg in LEGS}
    data |= {f"own_high_{leg}": np.full(3, 5500.0) for leg in LEGS}
    data |= {f"estimate_own_{leg}": np.full(3, 5000.0) for leg in LEGS}
    assert np.array_equal(beyond_friction(data, "own")["rl"], [0.0, 200.0, -500.0])


def test_a_leg_is_judged_by_its_own_cylinder_also_where_the_estimate_has_learnt_that_its_sensor_lies() -> (
    None
):
    """The fused estimate agrees with the model; the leg alone reads 900 N less, of which friction
    explains 500 N.
    """
    data = {f"expected_{leg}": np.full(3, 5000.0) for leg in LEGS}
    for name, value in (
        ("estimate_own", 5000.0),
        ("own_low", 4500.0),
        ("own_high", 5500.0),
        ("estimate_friction", 4100.0),
    ):
        data |= {f"{name}_{leg}": np.full(3, value) for leg in LEGS}
    assert np.array_equal(beyond_friction(data, "own")["fr"], [400.0] * 3)
    assert np.array_equal(load_residuals(data, "own")["fr"], [900.0] * 3)


@pytest.mark.parametrize(
    ("gaps", "leg"),
    [
        ((900, 0, 0, 0), "fl"),
        ((0, 100, -900, 0), "rl"),
        ((900, 0, 400, 0), None),
        ((140, 0, 0, 0), None),
        ((0,) * 4, None),
    ],
)
def test_one_leg_beyond_friction_is_named_and_two_are_not(
    gaps: tuple[float, ...], leg: str | None
) -> None:
    found = odd_one_out(dict(zip(LEGS, map(float, gaps), strict=True)), dict.fromkeys(LEGS, 6000.0))
    assert (found.leg if found else None) == leg


def test_a_gain_error_shows_in_its_legs_residual() -> None:
    data, _ = synthetic_columns(10.0, gain_error_fl=-0.08)
    medians = {leg: float(np.median(r)) for leg, r in load_residuals(data, "kbf").items()}
    found = suspect(medians, dict.fromkeys(LEGS, 6000.0))
    assert found is not None and found.leg == "fl"
    assert found.error_n == pytest.approx(0.08 * 6300.0, rel=0.15)


def test_expectations_name_what_they_found() -> None:
    expect = Expect(
        verdict="stood", summary={"force_rms_n.kbf": Bound(max=100.0), "a.0": Bound(equals=3.0)}
    )
    assert unmet(expect, {"verdict": "stood", "force_rms_n": {"kbf": 99.0}, "a": [3]}) == []
    lines = unmet(expect, {"verdict": "fell", "force_rms_n": {"kbf": 101.0}})
    assert lines == [
        "verdict is 'fell', expected 'stood'",
        "force_rms_n.kbf is 101, expected at most 100",
        "a.0 is None, expected 3.0",
    ]


@pytest.mark.parametrize(("expected_n", "share"), [(0.0, None), (500.0, None), (1800.0, -0.5)])
def test_a_foot_in_the_air_that_reads_a_load_stands_out_without_a_share(
    expected_n: float, share: float | None
) -> None:
    """A share of nothing is no number; the leg is named all the same."""
    columns = {}
    for leg in LEGS:
        columns[f"expected_{leg}"] = np.full(5, expected_n)
        reads_n = expected_n + (1000.0 if leg == "rr" else 0.0)
        columns[f"estimate_friction_{leg}"] = columns[f"estimate_own_{leg}"] = np.full(5, reads_n)
        columns[f"own_low_{leg}"], columns[f"own_high_{leg}"] = (
            np.full(5, -100.0),
            np.full(5, 100.0),
        )
    found = residual_summary(columns, ["own"])["stands_out"]
    assert found["leg"] == "rr" and found["error_n"] == pytest.approx(-900.0)
    assert found["share"] == (share if share is None else pytest.approx(share))
    percent = "" if share is None else " (50.0 %)"
    assert f"at least 900 N{percent} more" in str(Suspect(**found))
