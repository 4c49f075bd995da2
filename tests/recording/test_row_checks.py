"""What the rows of every recording must satisfy, at the very ends of what is let through."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.recording.axis_header import Calibration, Channel
from testbed.recording.checks import (
    MINIMUM_SAMPLES,
    MOST_PA,
    check_finite,
    check_pressure,
    check_span,
    check_time,
    in_pa,
    pressure,
)

FILE, HEADER = Path("data.csv"), Path("recording.yaml")
TIME_S = np.arange(100) / 200.0


def channel(**fields: Any) -> Channel:
    return Channel.model_validate({"column": "p_a", "unit": "Pa"} | fields)


def test_an_even_clock_is_let_through() -> None:
    check_time(TIME_S, 200.0, FILE, HEADER)
    check_time(TIME_S[:MINIMUM_SAMPLES], 200.0, FILE, HEADER)


@pytest.mark.parametrize(
    ("time", "said"),
    [
        (TIME_S[: MINIMUM_SAMPLES - 1], "too few samples: 49"),
        (np.where(np.arange(100) == 60, np.nan, TIME_S), "is not finite at row 60"),
        (np.where(np.arange(100) == 60, TIME_S[59], TIME_S), "time stands still at row 60"),
        (np.where(np.arange(100) == 60, 0.0, TIME_S), "time goes backwards at row 60"),
        (1000.0 * TIME_S, "'time' is hardly in s"),
    ],
)
def test_a_clock_that_cannot_be_is_refused_with_its_first_row(time: np.ndarray, said: str) -> None:
    with pytest.raises(InputError, match=said):
        check_time(time, 200.0, FILE, HEADER)


@pytest.mark.parametrize("factor", [0.02, 50.0])
def test_a_rate_within_a_factor_of_a_hundred_may_be_declared_wrongly(factor: float) -> None:
    check_time(TIME_S, 200.0 * factor, FILE, HEADER)


def test_positions_may_span_two_strokes_and_no_more() -> None:
    check_span("channels.position", "m", np.array([0.0, 1.0]), 0.5, HEADER)
    check_span("channels.position", "m", np.array([0.0, 19.0]), None, HEADER)
    with pytest.raises(InputError, match="span 400 mm, no cylinder is so long"):
        check_span("channels.position", "mm", np.array([0.0, 400.0]), None, HEADER)
    with pytest.raises(InputError, match=r"span 400 mm, the stroke is 0\.5 m"):
        check_span("channels.position", "mm", np.array([0.0, 400.0]), 0.5, HEADER)


def test_the_first_value_that_is_none_is_named_with_how_many_there_are() -> None:
    values = np.ones(100)
    values[[40, 41, 99]] = np.inf, np.nan, np.nan
    with pytest.raises(InputError, match=r"at row 40 \(t = 0\.2 s\): inf \(3 such rows\)"):
        check_finite("p_a", values, TIME_S, FILE)


def test_a_transducer_may_read_a_fifth_of_its_range_beyond_its_ends() -> None:
    ranged = channel(range_pa=(0.0, 1.0e7))
    check_pressure(ranged, np.array([-1.9e6, 1.19e7]), TIME_S[:2], FILE)
    for beyond in (-2.1e6, 1.21e7):
        with pytest.raises(InputError, match="beyond its transducer"):
            check_pressure(ranged, np.array([5e6, beyond]), TIME_S[:2], FILE)


def test_without_a_range_only_what_no_machine_holds_is_refused() -> None:
    check_pressure(channel(), np.array([0.99 * MOST_PA]), TIME_S[:1], FILE)
    with pytest.raises(InputError, match="beyond its transducer"):
        check_pressure(channel(), np.array([1.5 * MOST_PA]), TIME_S[:1], FILE)


def test_readings_at_the_ends_of_the_range_are_marked_and_the_low_end_only_where_it_is_not_zero() -> (
    None
):
    read = np.array([0.0, 1.0e3, 5.0e6, 1.0e7, 1.001e7])
    _, at_end = pressure(channel(range_pa=(0.0, 1.0e7)), read, TIME_S[:5], FILE)
    assert at_end is not None and at_end.tolist() == [False, False, False, True, True]
    _, at_end = pressure(channel(range_pa=(1.0e3, 1.0e7)), read, TIME_S[:5], FILE)
    assert at_end is not None and at_end.tolist() == [True, True, False, True, True]
    assert pressure(channel(), read, TIME_S[:5], FILE)[1] is None
    assert pressure(None, read, TIME_S[:5], FILE) == (None, None)


def test_volts_become_pascals_by_equation_2_and_back() -> None:
    calibration = {"k_pa_per_v": 2.0e6, "a": 1.05, "b": -0.1}
    volts = np.array([0.5, 1.0, 2.0])
    found = in_pa(channel(unit="V", calibration=calibration), volts)
    assert found == pytest.approx(2.0e6 * (1.05 * volts - 0.1))
    shape = Calibration.model_validate(calibration)
    assert shape.volts(found) == pytest.approx((volts * 1.05 - 0.1 + 0.1) / 1.05)
    assert in_pa(channel(), found) is found
