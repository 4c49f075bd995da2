"""What a loss is, and the score of a contact state, on signals whose answer is counted by hand."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.estimation.losses import carrying_from_load, score_contact

TIME = np.arange(2000) / 1000.0


def _flags(*spans: tuple[float, float]) -> np.ndarray:
    out = np.ones(len(TIME), dtype=bool)
    for start, end in spans:
        out[round(1000 * start) : round(1000 * end)] = False
    return out


def test_a_loss_is_three_percent_for_twenty_milliseconds() -> None:
    load = np.full(len(TIME), 20.0)
    load[100:119], load[500:520], load[900:1000] = 0.0, 0.59, 0.61
    np.testing.assert_array_equal(carrying_from_load(load, TIME, 20.0), _flags((0.5, 0.52)))


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
