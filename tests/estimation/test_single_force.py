"""Contact from one force: any scale, rate, noise and offset; causal; the same sample by sample as
over the recording.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from synthetic_walk import Walk

from testbed.errors import InputError
from testbed.estimation.contact_losses import ContactScore, LossRule, intervals, score_contact
from testbed.estimation.detectors.foot_scale import assumed_breakaway_n, breakaway_n, nominal_load_n
from testbed.estimation.detectors.single_force import ForceSample, SingleForce
from testbed.estimation.live.stream import Feet


def _states(time: np.ndarray, force: np.ndarray, nominal_n: float) -> np.ndarray:
    feet = Feet(SingleForce(), np.array([nominal_n]), np.zeros(1))
    return feet.over(time, force[:, None])[0][:, 0]


def _score(walk: Walk) -> ContactScore:
    time, true, reading = walk.draw()
    carrying = LossRule(walk.nominal_n).carrying(true, time)
    return score_contact(_states(time, reading, walk.nominal_n), carrying, time)


HARD = Walk(noise=0.03, offset=0.02, drift_per_s=0.001, missing=0.1, jitter=1.0, ramp_s=0.2)


@pytest.mark.parametrize(
    ("walk", "missed_share", "false_share"),
    [
        (Walk(), 0.01, 0.01),
        (Walk(noise=0.05), 0.02, 0.01),
        (Walk(offset=0.12), 0.01, 0.01),
        (Walk(offset=-0.05), 0.01, 0.01),
        (Walk(drift_per_s=0.005), 0.01, 0.01),
        (Walk(friction=0.05), 0.02, 0.01),
        (Walk(ramp_s=0.5), 0.01, 0.02),
        (Walk(ramp_s=2.0), 0.01, 0.05),
        (Walk(rate_hz=50.0), 0.03, 0.01),
        (Walk(rate_hz=5000.0, noise=0.05, duration_s=20.0), 0.02, 0.01),
        (HARD, 0.02, 0.02),
    ],
)
def test_every_loss_is_found_and_little_time_is_wrong(
    walk: Walk, missed_share: float, false_share: float
) -> None:
    time, true, _ = walk.draw()
    carrying = LossRule(walk.nominal_n).carrying(true, time)
    air_s = float((~carrying).sum() / walk.rate_hz)
    found = _score(walk)
    assert found.losses >= 5 and found.missed == 0
    assert found.missed_s <= missed_share * air_s
    assert found.false_flight_s <= false_share * (walk.duration_s - air_s)
    assert found.touchdown_delay_median_s is not None
    assert found.touchdown_delay_median_s <= 0.02 + 0.01 * walk.ramp_s


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_the_same_signal_on_another_scale_gives_the_same_states(factor: float) -> None:
    time, _, reading = HARD.draw()
    expected = _states(time, reading, 9500.0)
    assert 0.1 < np.mean(expected) < 0.9
    np.testing.assert_array_equal(_states(time, factor * reading, factor * 9500.0), expected)


def test_sample_by_sample_with_late_ones_is_what_the_recording_gives() -> None:
    time, _, reading = replace(HARD, duration_s=8.0).draw()
    feet, found = Feet(SingleForce(), np.array([9500.0]), np.zeros(1)), []
    for k, (t, force) in enumerate(zip(time, reading, strict=True)):
        found.append(feet.update(t, np.array([force]))[0])
        if k % 7 == 3:  # a late one, and the same once more
            assert feet.update(time[k - 2], np.array([-1e6]))[0] == found[-1]
            assert feet.update(t, np.array([1e6]))[0] == found[-1]
    np.testing.assert_array_equal(found, _states(time, reading, 9500.0))


def test_a_recording_that_begins_in_the_air_does_not_hide_the_losses_that_follow() -> None:
    """A relaxed seal reads nothing in the first flight, and 10 % of the load in all others."""
    time = np.arange(20_000) / 500.0
    carrying = (time % 2.0) >= 0.8
    force = np.where(carrying, 0.9, np.where(time < 0.8, 0.0, 0.1))
    force += np.random.default_rng(4).normal(0.0, 0.005, len(time))
    found = score_contact(_states(time, 9500.0 * force, 9500.0), carrying, time)
    assert found.losses == 19 and found.missed == 0
    assert found.missed_s < 0.1 and found.false_flight_s < 0.5


def test_a_jolt_in_the_air_is_no_lasting_touchdown() -> None:
    time = np.arange(4000) / 1000.0
    force = np.where(time < 1.0, 20.0, 0.0) + np.random.default_rng(2).normal(0.0, 0.1, 4000)
    force[2000:2015] += 1.0
    force[2015:2030] -= 1.0
    lost = _states(time, force, 20.0) < 0.5
    assert np.all(lost[1010:2000]) and np.all(lost[2100:])


@pytest.mark.parametrize("rate_hz", [66.0, 400.0])
def test_lone_outliers_teach_no_level_and_call_no_loss(rate_hz: float) -> None:
    walk = Walk(rate_hz=rate_hz, noise=0.03)
    time, true, reading = walk.draw()
    hit = np.random.default_rng(3).random(len(time)) < 0.003
    assert hit.sum() >= 5
    reading[hit] -= 3.0 * walk.nominal_n
    carrying = LossRule(walk.nominal_n).carrying(true, time)
    states = _states(time, reading, walk.nominal_n)
    found = score_contact(states, carrying, time)
    assert found.missed == 0 and found.false_alarms <= 1
    assert np.mean((states > 0.5) != carrying) < 0.02


def test_a_zero_that_drifts_by_more_than_half_the_load_is_followed() -> None:
    for drift in (0.015, -0.015):
        found = _score(Walk(noise=0.01, drift_per_s=drift, duration_s=50.0))
        assert found.missed == 0 and found.missed_s < 1.0 and found.false_flight_s < 1.0


def test_a_force_that_swings_with_the_foot_in_the_air_is_a_flight_still() -> None:
    walk = Walk(noise=0.005)
    time, true, reading = walk.draw()
    carrying = LossRule(walk.nominal_n).carrying(true, time)
    own_mass = np.zeros(len(time))
    for start, end in intervals(~carrying, time):
        phase = np.linspace(0.0, 2.0 * np.pi, end - start)
        own_mass[start:end] = 0.08 * walk.nominal_n * np.sin(phase)
    force = reading + own_mass
    breakaway = assumed_breakaway_n(force, time, walk.nominal_n)
    feet = Feet(SingleForce(), np.array([walk.nominal_n]), np.array([breakaway]))
    found = score_contact(feet.over(time, force[:, None])[0][:, 0], carrying, time)
    assert found.missed == 0 and found.missed_s < 0.3 and found.false_flight_s < 1.0


def test_what_comes_later_changes_nothing_before() -> None:
    time, _, reading = HARD.draw()
    np.testing.assert_array_equal(
        _states(time[:9000], reading[:9000], 9500.0), _states(time, reading, 9500.0)[:9000]
    )


def test_through_a_gap_the_state_holds_and_is_not_known() -> None:
    time = np.arange(3000) / 1000.0
    force = np.where(time < 1.0, 20.0, 0.0)
    force[1500:2500] = np.nan
    states, known = Feet(SingleForce(), np.array([20.0]), np.zeros(1)).over(time, force[:, None])
    assert np.all(states[1010:, 0] == 0.0) and np.all(states[:1000, 0] == 1.0)
    assert np.flatnonzero(~known[:, 0]).tolist() == list(range(1600, 2500))


@pytest.mark.parametrize("wrong_s", [np.nan, np.inf, -np.inf])
def test_a_sample_whose_time_is_no_number_is_left_out_and_the_next_one_is_heard(
    wrong_s: float,
) -> None:
    time = np.arange(1000) / 1000.0
    force = np.where(time < 0.5, 20.0, 0.0)
    feet, told = Feet(SingleForce(), np.array([20.0]), np.zeros(1)), []
    for k, (t, one) in enumerate(zip(time, force, strict=True)):
        if k == 300:
            feet.update(wrong_s, np.zeros(1))
            assert feet.known.all()
        told.append(feet.update(t, np.array([one]))[0])
    np.testing.assert_array_equal(told, _states(time, force, 20.0))
    assert told[-1] == 0.0


def test_no_samples_say_nothing_and_another_number_of_forces_is_refused() -> None:
    feet = Feet(SingleForce(), np.array([20.0]), np.zeros(1))
    states, known = feet.over(np.empty(0), np.empty((0, 1)))
    assert states.shape == known.shape == (0, 1)
    with pytest.raises(InputError, match="force_n"):
        feet.update(0.0, np.zeros(2))


def test_rows_that_are_left_out_are_as_good_as_missing_numbers() -> None:
    time, true, reading = replace(HARD, missing=0.0, duration_s=60.0).draw()
    kept = np.random.default_rng(1).random(len(time)) > 0.3
    states = _states(time[kept], reading[kept], 9500.0)
    carrying = LossRule(9500.0).carrying(true, time)[kept]
    assert np.mean((states > 0.5) != carrying) < 0.02


class Below:
    """Lost below a tenth of the nominal load."""

    threshold = 0.9

    def update(self, sample: object) -> np.ndarray:
        return 1.0 - sample.force / sample.nominal_load  # type: ignore[attr-defined]


class Nameless:
    def update(self, sample: object) -> np.ndarray:
        return np.zeros(1)


def test_a_detector_of_ones_own_judges_forces_sample_by_sample_alike() -> None:
    time, true, reading = replace(HARD, duration_s=8.0).draw()
    whole, _ = Feet(Below(), np.array([9500.0]), np.zeros(1)).over(time, reading[:, None])
    feet = Feet(Below(), np.array([9500.0]), np.zeros(1))
    one_by_one = [feet.update(t, np.array([f])) for t, f in zip(time, reading, strict=True)]
    np.testing.assert_array_equal(whole, one_by_one)
    assert np.mean((whole[:, 0] > 0.5) != LossRule(9500.0).carrying(true, time)) < 0.1
    with pytest.raises(InputError, match="threshold"):
        Feet(Nameless(), np.ones(1), np.zeros(1))


def test_two_feet_of_different_scale_do_not_mind_each_other() -> None:
    time, _, reading = Walk(duration_s=8.0).draw()
    both, _ = Feet(SingleForce(), np.array([9500.0, 19.0]), np.zeros(2)).over(
        time, np.column_stack([reading, 2e-3 * reading])
    )
    np.testing.assert_array_equal(both[:, 0], both[:, 1])


def test_the_scale_is_read_from_the_force() -> None:
    time, _, reading = Walk(noise=0.02).draw()
    assert nominal_load_n(reading) == pytest.approx(9500.0, rel=0.2)
    assert breakaway_n(reading, time) == pytest.approx(3.0 * 0.02 * 9500.0, rel=0.2)
    assert nominal_load_n(1e-3 * reading) == pytest.approx(1e-3 * nominal_load_n(reading))


class _Own:
    """One's own detector of forces; what it is handed is used up."""

    threshold = 0.9

    def __init__(self, answer: Any = None) -> None:
        self._answer = answer

    def update(self, sample: ForceSample) -> Any:
        if self._answer is not None:
            return self._answer
        scores = 1.0 - sample.force / sample.nominal_load
        sample.force[:] = sample.nominal_load[:] = sample.breakaway[:] = 0.0
        return scores


def test_ones_own_detector_of_forces_is_handed_copies() -> None:
    """Below a tenth of 100 N the foot is lost, at every sample alike."""
    time, force = np.arange(400) * 1e-3, np.full(400, 100.0)
    force[100:200] = 5.0
    nominal, before = np.array([100.0]), force.copy()
    states, _ = Feet(_Own(), nominal, np.zeros(1)).over(time, force[:, None])
    assert not states[105:200].any() and states[:100].all() and states[250:].all()
    np.testing.assert_array_equal(force, before)
    assert nominal[0] == 100.0


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ("lost", "answered what are no scores"),
        (np.zeros(4), r"\(4,\): answered what are no scores"),
        (np.array([np.nan]), r"a score is no number at t = 0\.000 s"),
    ],
    ids=["a word", "four scores of one foot", "no number"],
)
def test_what_is_no_score_of_a_foot_is_refused(answer: Any, said: str) -> None:
    feet = Feet(_Own(answer), np.array([100.0]), np.zeros(1))
    with pytest.raises(InputError, match=said):
        feet.update(0.0, np.array([90.0]))


def test_a_missing_force_asks_for_no_score() -> None:
    feet = Feet(_Own(np.array([0.0, np.nan])), np.full(2, 100.0), np.zeros(2))
    assert feet.update(0.0, np.array([90.0, np.nan])).tolist() == [1.0, 1.0]
