"""Series made short enough to draw: no peak is lost, no mean is moved, and limits leave out spikes
alone.
"""

from __future__ import annotations

import numpy as np
import pytest

from testbed.report.page import Table, markdown
from testbed.report.series import busiest, course, envelope, limits, spread

TIME_S = np.arange(10_000) / 100.0


def test_a_single_spike_survives_the_envelope() -> None:
    values = np.zeros(len(TIME_S))
    values[[3_333, 7_007]] = 50.0, -40.0
    time, drawn = envelope(TIME_S, values)
    assert len(time) == len(drawn) == 840
    assert (drawn.max(), drawn.min()) == (50.0, -40.0)
    assert time[np.argmax(drawn)] == pytest.approx(33.33, abs=0.25)
    assert (np.diff(time) > 0.0).all()


def test_what_is_short_enough_is_drawn_as_it_is() -> None:
    time, values = TIME_S[:800], np.sin(TIME_S[:800])
    assert all(
        drawn is given for drawn, given in zip(envelope(time, values), (time, values), strict=True)
    )
    assert course(time, values)[1] is values


def test_samples_that_are_not_numbers_are_passed_over_where_others_are_near() -> None:
    values = np.ones(len(TIME_S))
    values[::2] = np.nan
    assert np.isfinite(envelope(TIME_S, values)[1]).all()


def test_the_course_of_a_ramp_is_the_ramp_and_keeps_its_mean() -> None:
    time, drawn = course(TIME_S, 2.0 + 0.5 * TIME_S)
    assert drawn == pytest.approx(2.0 + 0.5 * time)
    assert drawn.mean() == pytest.approx((2.0 + 0.5 * TIME_S).mean())


def test_the_spread_of_each_stretch_holds_all_of_its_values() -> None:
    values = np.random.default_rng(1).normal(size=len(TIME_S))
    middle, low, high = spread(TIME_S, values, bins=100)
    assert middle == pytest.approx(TIME_S.reshape(100, 100).mean(axis=1))
    assert low == pytest.approx(values.reshape(100, 100).min(axis=1))
    assert high == pytest.approx(values.reshape(100, 100).max(axis=1))


def test_fewer_samples_than_stretches_are_stretches_of_their_own() -> None:
    middle, low, high = spread(TIME_S[:7], TIME_S[:7] ** 2)
    assert (middle == TIME_S[:7]).all() and (low == high).all()


def test_limits_leave_a_lone_spike_out_and_some_room_around_the_rest() -> None:
    values = np.concatenate([np.linspace(-1.0, 1.0, 5_000), [1e6, np.nan, np.inf]])
    low, high = limits(values)
    assert -1.25 < low < -1.0 and 1.0 < high < 1.25


def test_limits_of_a_constant_and_of_nothing_can_be_drawn() -> None:
    low, high = limits(np.full(10, 3.0))
    assert low < 3.0 < high
    assert limits() == limits(np.array([np.nan])) == (0.0, 1.0)


def test_the_busiest_second_is_where_most_happens() -> None:
    values = np.where((TIME_S > 40.0) & (TIME_S < 41.0), np.sin(60.0 * TIME_S), 0.0)
    start, end = busiest(TIME_S, values)
    assert start == pytest.approx(40.0, abs=0.05) and end - start == pytest.approx(1.0)


def test_a_series_shorter_than_the_stretch_is_shown_whole() -> None:
    assert busiest(TIME_S[:50], TIME_S[:50]) == (0.0, pytest.approx(0.49))


def test_a_bar_in_a_cell_does_not_end_the_cell() -> None:
    text = markdown(Table("Loads", ["foot", "N"], [["fl | fr", "3"]]))
    assert text.splitlines() == [
        "## Loads",
        "",
        "| foot | N |",
        "| --- | --- |",
        "| fl \\| fr | 3 |",
    ]
