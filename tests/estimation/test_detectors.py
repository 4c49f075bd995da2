"""Detectors of contact loss: each speaks for a loss and not before, causally; the seals slip as
they must.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.estimation.detectors.base import Hold, scaled, scores_over
from testbed.estimation.detectors.classical import Cusum, Glr, Momentum
from testbed.estimation.detectors.combined import Combined, Held, Steady
from testbed.estimation.detectors.foot_history import BREAK_AWAY
from testbed.estimation.detectors.foot_view import VIEW, FootMemory, ViewNumbers, views_over
from testbed.estimation.detectors.learned import Learned, Patient, shipped_network
from testbed.estimation.detectors.sample import OilState, Sample, Sampler, oil_travel
from testbed.estimation.detectors.table import DETECTORS, LIVE, detector_of
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.chain import belief_of
from testbed.estimation.live.contact import ContactState, limits_at, step
from testbed.estimation.live.selected import limits_of
from testbed.formats.intervals import Z90
from testbed.machine.build import build_machine
from testbed.recording.rows import METHODS, DataRow

MACHINE = build_machine()
BELIEF = belief_of(Believed.from_machine(MACHINE, 1e-3))
CYLINDER = BELIEF["legs"]["cylinder"][0, 0]


def _samples(load: np.ndarray) -> Any:
    """Every rung reads `load` (n,) on all four feet; 5 kN are expected."""
    out = Sample.zeros(len(load))
    for name in METHODS:
        out["row"]["estimate"][name] = load[:, None]
    for name in ("carried", "balance"):
        out["derived"][name] = load[:, None]
    out["row"]["expected"] = 5000.0
    return out.view(np.recarray)


def _scores(name: str, load: np.ndarray) -> np.ndarray:
    return scores_over(detector_of(name), _samples(load))


@pytest.mark.parametrize("name", [d.name for d in DETECTORS if d is not Learned])
def test_a_lost_foot_scores_higher_than_any_moment_before_and_all_feet_alike(name: str) -> None:
    load = np.concatenate([np.full(500, 5000.0), np.zeros(200)])
    score = _scores(name, load)
    assert score[550:].max() > score[:500].max()
    assert np.all(score == score[:, :1])


@pytest.mark.parametrize("name", [d.name for d in DETECTORS])
def test_a_score_does_not_depend_on_what_comes_later(name: str) -> None:
    rng = np.random.default_rng(3)
    load = 4000.0 + rng.normal(0.0, 300.0, 400)
    other = np.concatenate([load[:300], rng.normal(0.0, 300.0, 100)])
    assert np.array_equal(_scores(name, load)[:300], _scores(name, other)[:300])


@pytest.mark.parametrize("name", [d.name for d in DETECTORS])
def test_a_machine_of_an_eighth_of_the_forces_is_judged_alike(name: str) -> None:
    rng = np.random.default_rng(5)
    load = np.concatenate([4000.0 + rng.normal(0.0, 300.0, 200), rng.normal(0.0, 200.0, 100)])
    small, eighth = scaled(detector_of(name), 0.125), _samples(0.125 * load)
    eighth["row"]["expected"] *= 0.125
    own = detector_of(name)
    lost = scores_over(own, _samples(load)) >= own.threshold
    assert np.array_equal(scores_over(small, eighth) >= small.threshold, lost)


@pytest.mark.parametrize("name", [d.name for d in DETECTORS])
def test_sample_by_sample_gives_the_scores_of_the_whole(name: str) -> None:
    load = 2000.0 + np.random.default_rng(4).normal(0.0, 900.0, 100)
    detector, samples = detector_of(name), _samples(load)
    one_by_one = np.array([detector.update(sample) for sample in samples])
    np.testing.assert_array_equal(one_by_one, _scores(name, load))


def test_an_unknown_name_is_refused_with_those_there_are() -> None:
    with pytest.raises(InputError, match=r"no such detector.*combined.*FILE\.py:Class"):
        detector_of("combinde")


def test_a_class_of_ones_own_is_a_detector_by_its_file(tmp_path: Path) -> None:
    mine = tmp_path / "mine.py"
    mine.write_text(
        "class Mine:\n    def update(self, sample):\n        return -sample.row.estimate.own\n"
        "class Other:\n    pass\n"
    )
    load = np.linspace(5000.0, 0.0, 50)
    found = scores_over(detector_of(f"{mine}:Mine"), _samples(load))
    np.testing.assert_array_equal(found, np.repeat(-load[:, None], 4, axis=1))
    with pytest.raises(InputError, match="has no method update"):
        detector_of(f"{mine}:Other")


def _combined(own: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Load that the combined detector sees where `balance` and `carried` read `others` (n,) and the
    estimate `own`.
    """
    samples = _samples(others)
    samples["row"]["estimate"]["own"] = own[:, None]
    return -Combined().scores(samples)[:, 0]


def test_a_drifting_sensor_is_given_back_what_friction_cannot_explain() -> None:
    """Drifted by 4 kN, 800 N of them friction's: 0.35 * 4000 + (0.3 + 0.35) * 3200 = 3480 N, not
    1400.
    """
    own = np.full(100_000, 4000.0)
    assert _combined(own, np.zeros(100_000))[-1] == pytest.approx(3480.0, abs=1.0)
    assert _combined(own, np.full(100_000, 3300.0))[-1] == pytest.approx(
        0.35 * 4000.0 + 0.65 * 3300.0
    )


def test_a_foot_lost_after_a_drift_is_still_seen_within_a_hundredth_of_a_second() -> None:
    lost = np.concatenate([np.full(60_000, 4000.0), np.zeros(20)])
    seen = _combined(lost, lost - 3000.0)
    assert seen[59_999] > 3000.0
    assert seen[60_010] < seen[59_999] - 3900.0


def test_the_steady_detector_is_the_combined_one_over_twenty_milliseconds() -> None:
    score = Steady().scores(_samples(np.concatenate([np.full(500, 5000.0), np.zeros(21)])))
    assert -score[-1, 0] == pytest.approx(5000.0 * (20.0 / 21.0) ** 21)


def test_the_live_contact_state_is_judged_by_the_one_that_the_chain_steps() -> None:
    """What the chain steps in its own compiled call carries the numbers of that detector's file."""
    assert Held.name == LIVE
    names = BELIEF["combined"].dtype.names
    assert {name: BELIEF["combined"][name][0] for name in names} == Held.numbers
    assert BELIEF["contact"] == limits_of(Held(), "")


def _words(detector: Any, load: np.ndarray) -> np.ndarray:
    """Whether a detector calls a foot with this load (n,), N, lost."""
    limits, state = limits_of(detector, ""), ContactState.zeros()[0]
    state.contact = 1.0
    scores = detector.scores(_samples(load))[:, 0]
    return np.array([step(state, -score, 1e-3, limits) == 0.0 for score in scores])


def test_a_foot_that_taps_the_ground_with_every_blow_is_one_alarm_and_not_many() -> None:
    """600 +- 500 N at 12 Hz: a held word stays, one of a single level follows every blow."""
    load = 600.0 + 500.0 * np.sin(2.0 * np.pi * 12.0 * np.arange(2000) * 1e-3)
    held, steady = _words(Held(), load), _words(Steady(), load)
    assert np.count_nonzero(np.diff(held.astype(int)) == 1) <= 1 and held[1000:].all()
    assert np.count_nonzero(np.diff(steady.astype(int)) == 1) >= 15


@pytest.mark.parametrize(("back_n", "after_s"), [(5000.0, 0.02), (1000.0, 0.22)])
def test_a_touchdown_is_believed_sooner_the_clearer_it_is(back_n: float, after_s: float) -> None:
    load = np.concatenate([np.full(500, 5000.0), np.zeros(500), np.full(800, back_n)])
    lost = _words(Held(), load)
    assert not lost[:500].any() and lost[540:1000].all()
    assert np.flatnonzero(~lost[1000:])[0] * 1e-3 == pytest.approx(after_s, abs=0.025)


@pytest.mark.parametrize("name", [Held.name, Learned.name])
def test_a_detector_of_a_larger_machine_says_the_same_of_larger_forces(name: str) -> None:
    load = np.concatenate([np.full(100, 3000.0), np.full(100, 200.0)])
    small, large = detector_of(name), scaled(detector_of(name), 2.0)
    samples, double = _samples(load), _samples(2.0 * load)
    double["row"]["expected"] *= 2.0
    per_threshold = small.scores(samples) / small.threshold
    np.testing.assert_allclose(large.scores(double) / large.threshold, per_threshold, rtol=1e-9)


def test_a_hold_of_forces_grows_with_the_machine() -> None:
    assert Hold(100.0, 0.3, 500.0, 0.02).scaled(2.0) == Hold(200.0, 0.3, 1000.0, 0.02)


def test_cusum_gains_the_log_likelihood_ratio_of_each_sample() -> None:
    """m0 = 1000, s = 500, load 250: -1000 / 250 000 (250 - 500) = 1 nat a sample; it cannot fall
    below 0.
    """
    cusum = Cusum(least_load=1000.0, sd=500.0, limit=5.0)
    score = cusum.scores(_samples(np.array([3000.0, 250.0, 250.0, 250.0, 750.0])))
    assert score[:, 0] == pytest.approx([0.0, 1.0, 2.0, 3.0, 2.0])


def test_glr_of_white_noise_is_the_textbook_ratio() -> None:
    """Uncoloured, m0 = 1000, m1 = 0, s = 100: 40 samples of 0 N give 40 / 2 (1000 / 100)^2 = 2000
    nats.
    """
    glr = Glr(least_load=1000.0, most_lost=0.0, colour_1=0.0, colour_2=0.0, sd=100.0)
    score = glr.scores(_samples(np.concatenate([np.full(60, 5000.0), np.zeros(40)])))
    assert score[-1, 0] == pytest.approx(2000.0)
    assert score[59, 0] < 0.0


def test_the_momentum_observer_follows_the_force_with_its_time_constant() -> None:
    momentum = Momentum(gain=100.0)
    score = momentum.scores(_samples(np.concatenate([np.full(500, 5000.0), np.zeros(500)])))
    assert -score[499, 0] == pytest.approx(5000.0, rel=1e-6)
    assert -score[510, 0] == pytest.approx(5000.0 * (1.0 - 100.0 * 1e-3) ** 11)  # e^(-t K) in steps


@pytest.mark.parametrize("detector", [Learned, Patient])
def test_the_learned_score_is_its_network_on_the_views_smoothed(detector: Any) -> None:
    rng = np.random.default_rng(5)
    samples = _samples(2000.0 + rng.normal(0.0, 900.0, 30))
    views, scale = np.empty((30, 4, len(VIEW))), ViewNumbers.one(**Learned.scale)
    views_over(np.asarray(samples), scale, FootMemory.zeros(4), 1e-3, 1, views)
    (w0, b0), (w1, b1), (w2, b2) = shipped_network().layers
    odds = np.tanh(np.tanh(views @ w0.T + b0) @ w1.T + b1) @ w2[0] + b2[0]
    expected = [odds[0]]
    for now in odds[1:]:
        expected.append(expected[-1] + (now - expected[-1]) * 1e-3 / (detector.smooth_s + 1e-3))
    np.testing.assert_allclose(detector().scores(samples), expected, rtol=1e-9, atol=1e-9)


def test_a_view_begins_with_the_loads_in_units_of_the_loss_force() -> None:
    views = np.empty((1, 4, len(VIEW)))
    scale = ViewNumbers.one(**Learned.scale)
    views_over(np.asarray(_samples(np.array([2943.0]))), scale, FootMemory.zeros(4), 1e-3, 1, views)
    assert views[0, 0, :12] == pytest.approx(np.arcsinh(10.0))
    assert VIEW[0] == "loads_own_2_ms" and len(VIEW) == 70


def test_a_view_knows_side_forces_the_balance_and_a_sensor_that_drifts() -> None:
    """A foot pushed aside by 300 and 400 N, all feet 200 N above the expected, `carried` 1 kN off
    for long.
    """
    samples = _samples(np.full(30_000, 2000.0))
    row = samples["row"]
    row["own"]["x"][:, 0], row["own"]["y"][:, 0] = 300.0, 400.0
    row["expected"] = row["estimate"]["own"] - 200.0
    samples["derived"]["carried"] -= 1000.0
    views = np.empty((1, 4, len(VIEW)))
    scale = ViewNumbers.one(**Learned.scale)
    every = len(samples)
    views_over(np.asarray(samples), scale, FootMemory.zeros(4), 1e-3, every, views)
    seen = dict(zip(VIEW, np.sinh(views[0, 0]) * Learned.scale["loss_force"], strict=True))
    assert seen["sideways_300_ms"] == pytest.approx(500.0)
    assert seen["pushed"] == pytest.approx(500.0)
    assert seen["aside"] == pytest.approx(500.0)
    assert seen["beyond"] == pytest.approx(800.0)
    assert seen["behind_carried"] == pytest.approx(1000.0)
    assert seen["least"] == pytest.approx(2000.0)
    given_back = 1000.0 - BREAK_AWAY * Learned.scale["loss_force"]
    assert seen["history_free_50_ms"] == pytest.approx(1000.0 + given_back)


def test_a_view_knows_how_long_ago_a_foot_was_low_and_which_feet_are_stirred() -> None:
    """A foot that was in the air for 0.2 s, 0.3 s ago; another one alone feels a drill."""
    load = np.concatenate([np.full(3000, 5000.0), np.zeros(200), np.full(300, 5000.0)])
    samples = _samples(load)
    blows = 400.0 * np.sin(2.0 * np.pi * 20.0 * np.arange(len(load)) * 1e-3)
    samples["row"]["estimate"]["own"][:, 1:] = 5000.0
    samples["derived"]["carried"][:, 1:] = 5000.0
    samples["derived"]["carried"][:, 2] += blows
    views, scale = np.empty((1, 4, len(VIEW))), ViewNumbers.one(**Learned.scale)
    views_over(np.asarray(samples), scale, FootMemory.zeros(4), 1e-3, len(load), views)
    bounced, _, drilled, still = (dict(zip(VIEW, foot, strict=True)) for foot in views[0])
    since = 0.02 * (10.0 ** bounced["history_since_below"] - 1.0)
    assert since == pytest.approx(0.3, abs=0.02)
    assert 0.06 < bounced["history_low"] < 0.1
    assert drilled["history_low"] == 0.0
    stirred = "history_beside_50_ms"
    assert drilled[stirred] > 0.5 > 0.0 > still[stirred]


def test_a_view_knows_from_the_body_s_motion_which_corner_the_ground_pushes_back() -> None:
    """The body heaves by 0.1 mm at 20 Hz and rolls a little; three legs push back with 20 MN/m, one
    hangs.
    """
    time, turn = np.arange(2000) * 1e-3, 2.0 * np.pi * 20.0
    samples = _samples(np.full(len(time), 5000.0))
    place = 1.0e-4 * np.sin(turn * time)
    samples["row"]["specific_force"][:, 2] = 9.81 - turn**2 * place
    samples["row"]["angular_rate"][:, 0] = 0.3e-4 * turn * np.cos(turn * time)
    samples["derived"]["balance"] -= 20.0e6 * place[:, None]
    samples["derived"]["balance"][:, 0] = 0.0
    samples["row"]["estimate_own"]["spread"] = 1000.0 / Z90
    samples["row"]["estimate_own"]["low"] = -1e5  # an interval changes no view
    views, scale = np.empty((1, 4, len(VIEW))), ViewNumbers.one(**Learned.scale)
    views_over(np.asarray(samples), scale, FootMemory.zeros(4), 1e-3, len(time), views)
    hung, right, left, _ = (dict(zip(VIEW, foot, strict=True)) for foot in views[0])
    stiff = "motion_stiffness"
    assert right[stiff] > 5.0 * abs(hung[stiff]) and left[stiff] > 5.0 * abs(hung[stiff])
    corner = "motion_corner"
    assert left[corner] == pytest.approx(hung[corner]) and left[corner] > 0.1 > -0.1 > right[corner]
    low = np.sinh(left["motion_low"]) * Learned.scale["loss_force"]
    assert low == pytest.approx(4000.0)


def test_a_missing_reading_of_the_inertial_unit_spoils_no_later_view() -> None:
    samples = _samples(np.full(500, 5000.0))
    samples["row"]["specific_force"][100, 2] = np.nan
    views, scale = np.empty((500, 4, len(VIEW))), ViewNumbers.one(**Learned.scale)
    views_over(np.asarray(samples), scale, FootMemory.zeros(4), 1e-3, 1, views)
    assert np.isfinite(views).all()


def _leak_free() -> np.ndarray:
    belief = BELIEF.copy()
    for name in ("leakage", "leakage_pa", "leakage_at", "leakage_pb", "leakage_bt"):
        belief["legs"]["valve"][name] = 0.0
    return belief


def _carried(load: np.ndarray, friction: np.ndarray) -> np.ndarray:
    """`carried` for a still, shut cylinder whose pressures bear `load` plus `friction` (n,), N; B
    at 2 MPa.
    """
    rows = DataRow.zeros(len(load))
    weight = BELIEF["legs"]["mass"][0, 0] * 9.81
    force = load + friction - weight
    rows["pressure_a"] = ((force + 2.0e6 * CYLINDER["area_b"]) / CYLINDER["area_a"])[:, None]
    rows["pressure_b"], rows["position"], rows["supply_pressure"] = 2.0e6, 0.25, 9.0e6
    return np.array(Sampler(_leak_free()).samples(rows)["derived"]["carried"][:, 0])


@pytest.mark.parametrize("before", [-700.0, 0.0, 800.0])
def test_after_a_loss_of_twice_the_break_away_the_load_is_known_whatever_friction_was(
    before: float,
) -> None:
    """The foot extends as it is let go, so friction ends at its upper bound: 620 + 180 N."""
    load = np.concatenate([np.full(300, 6000.0), np.linspace(6000.0, 0.0, 50), np.zeros(200)])
    friction = np.concatenate(
        [np.full(300, before), np.linspace(before, 800.0, 50), np.full(200, 800.0)]
    )
    assert abs(_carried(load, friction)[-1]) < 1.0


def test_a_small_change_of_load_is_shared_between_oil_and_seal() -> None:
    """Unloading by dF lengthens oil and seal together: the pressures show k_oil / (k_oil + k_seal)
    of it.
    """
    dp, state = 1.0e4, OilState.zeros()[0]
    state["pressure_a"], state["pressure_b"] = 3.0e6, 2.0e6
    valve = _leak_free()["legs"]["valve"][0, 0]
    travel = oil_travel((-dp, 0.0), 9.0e6, 0.25, state, CYLINDER, valve, 1e-3)
    k_oil = dp * CYLINDER["area_a"] / travel
    assert 4.0e6 < k_oil < 3.0e7
    step = 200.0
    seen = step * k_oil / (k_oil + CYLINDER["seal_stiffness"])
    load = np.concatenate([np.full(300, 6000.0), np.full(300, 6000.0 - step)])
    friction = np.concatenate([np.zeros(300), np.full(300, step - seen)])
    assert _carried(load, friction)[-1] == pytest.approx(6000.0 - step, abs=0.05 * step)


def test_a_believed_drift_of_a_sensor_is_taken_out_of_what_detectors_look_at() -> None:
    """100 kPa/s for 10 s on A would read as 3.85 kN; the load that it stands on stays what it
    is.
    """
    belief = _leak_free()
    belief["legs"]["cylinder"]["sensor_a"]["drift"] = 1.0e5
    rows = DataRow.zeros(10_000)
    rows["pressure_a"] = (3.0e6 + 1.0e5 * 1e-3 * np.arange(10_000))[:, None]
    rows["pressure_b"], rows["position"], rows["supply_pressure"] = 2.0e6, 0.25, 9.0e6
    balance = Sampler(belief).samples(rows)["derived"]["balance"][:, 0]
    assert np.ptp(balance) < 1.0


def test_a_lost_foot_is_loaded_again_once_the_mean_of_its_score_has_come_far_enough() -> None:
    """Minus the score steps from 0 to 2; its mean with time constant 1 s is 1 after ln 2 s. It
    reaches no other level of the hold, whose own mean would never end a loss.
    """
    dt, never = 1e-3, 1e9
    for slow_margin, expected_s in ((1.0, math.log(2.0)), (math.inf, math.inf)):
        hold = Hold(never, 0.2, sure_margin=never, slow_margin=slow_margin, slow_s=1.0)
        limits, state = limits_at(0.0, hold), ContactState.zeros()
        state["contact"] = 1.0
        assert step(state[0], 0.0, dt, limits[0]) == 0.0, "lost"
        steps = (k for k in range(3000) if step(state[0], 2.0, dt, limits[0]) == 1.0)
        found_s = dt * next(steps, math.inf)
        assert found_s == pytest.approx(expected_s, abs=2 * dt)
