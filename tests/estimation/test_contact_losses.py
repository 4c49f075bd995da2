"""What a loss is, and the score of a contact state, on signals whose answer is counted by hand."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.estimation.contact_losses import LossRule, follow, score_contact

TIME = np.arange(2000) / 1000.0


def _flags(*spans: tuple[float, float]) -> np.ndarray:
    out = np.ones(len(TIME), dtype=bool)
    for start, end in spans:
        out[round(1000 * start) : round(1000 * end)] = False
    return out


def test_a_loss_is_three_percent_for_twenty_milliseconds() -> None:
    load = np.full(len(TIME), 20.0)
    load[100:119], load[500:520], load[900:1000] = 0.0, 0.59, 0.61
    carrying = LossRule(20.0).carrying(load, TIME)
    np.testing.assert_array_equal(carrying, _flags((0.5, 0.52)))
    assert LossRule(20.0, share=0.025).carrying(load, TIME)[500]
    assert LossRule(20.0, shortest_s=0.021).carrying(load, TIME).all()


def test_a_touchdown_lasts_twenty_milliseconds_too() -> None:
    load = np.where(_flags((0.5, 1.0)), 20.0, 0.0)
    load[600:619] = load[700:720] = 20.0
    carrying = LossRule(20.0).carrying(load, TIME)
    np.testing.assert_array_equal(carrying, _flags((0.5, 0.7), (0.72, 1.0)))


def test_an_alarm_is_false_unless_a_loss_follows_within_a_tenth_of_a_second() -> None:
    lost = ~_flags((0.2, 0.21), (0.45, 0.55), (0.9, 1.0), (1.3, 1.4))
    found = follow(lost, _flags((0.5, 0.6), (1.01, 1.2)), TIME)
    assert found.false_alarms == (200, 900, 1300)
    assert [loss.delay_s for loss in found.losses] == [0.0, None]


def test_a_false_alarm_that_stands_counts_again_every_five_seconds() -> None:
    time = np.arange(1300) / 100.0
    lost = (time >= 1.0) & (time < 12.0)
    carrying = np.ones(len(time), dtype=bool)
    assert follow(lost, carrying, time).false_alarms == (100, 600, 1100)
    assert follow(carrying, carrying, time).false_alarms == (500, 1000)


def test_a_loss_that_was_on_at_the_start_is_none_but_its_seconds_count() -> None:
    found = score_contact(np.ones(len(TIME)), _flags((0.0, 0.3)), TIME)
    assert (found.losses, found.missed_s) == (0, pytest.approx(0.3))


def test_delays_and_wrong_seconds_are_counted() -> None:
    carrying = _flags((0.5, 0.8), (1.2, 1.4))
    contact = _flags((0.51, 0.83), (1.6, 1.7)).astype(float)
    found = score_contact(contact, carrying, TIME)
    assert (found.losses, found.missed) == (2, 1)
    assert found.delay_median_s == pytest.approx(0.01)
    assert found.touchdown_delay_median_s == pytest.approx(0.03)
    assert found.missed_s == pytest.approx(0.01 + 0.2)
    assert found.false_flight_s == pytest.approx(0.03 + 0.1)


def test_nothing_to_time_is_none() -> None:
    found = score_contact(np.ones(len(TIME)), _flags(), TIME)
    assert (found.losses, found.delay_median_s, found.missed_s) == (0, None, 0.0)


def test_a_gap_in_the_samples_counts_for_ten_of_them_at_most() -> None:
    time = np.append(TIME, TIME[-1] + 100.0)
    contact = np.append(np.ones(len(TIME) - 1), [0.0, 0.0])
    found = score_contact(contact, np.ones(len(time), dtype=bool), time)
    assert found.false_flight_s == pytest.approx(0.011)
