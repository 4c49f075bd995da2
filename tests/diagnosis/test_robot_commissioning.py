"""The regression by which the robot comes to know itself, on evidence whose answer is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from testbed.diagnosis.robot.commissioning import Evidence, Posterior
from testbed.diagnosis.robot.forces import Tolerated
from testbed.effects.signature import Change

MASS, ZERO, NONE = "total", "zero", ""


def _number(name: str, sd: float, mean: float = 0.0, drawn: float = 0.0) -> Tolerated:
    return Tolerated(Change(), sd, name, mean, drawn)


def _evidence(truth: dict[str, float], columns: np.ndarray, sd: float, *names: str) -> Evidence:
    """Of rows = columns @ truth, seen with noise of standard deviation `sd`."""
    numbers = tuple(_number(name, 2.0) for name in names)
    wide = columns * 2.0 / sd
    rows = columns @ np.array([truth[name] for name in names]) / sd
    return Evidence(numbers, wide.T @ wide, wide.T @ rows)


def test_numbers_that_rows_tell_apart_are_found() -> None:
    rng = np.random.default_rng(3)
    truth = {MASS: 1.5, ZERO: -0.7}
    found = Posterior.of([_evidence(truth, rng.normal(size=(500, 2)), 0.01, MASS, ZERO)])
    for name, value in truth.items():
        number = found.of_sum({name: 1.0}, "N", drawn=10.0)
        assert number.value == pytest.approx(10.0 + value, abs=3.0 * number.sd)
        assert number.sd < 0.01 and number.shown


def test_a_sum_is_surer_than_its_parts_where_only_it_is_seen() -> None:
    truth = {MASS: 1.5, ZERO: -0.7}
    found = Posterior.of([_evidence(truth, np.ones((100, 2)), 0.01, MASS, ZERO)])
    part, whole = found.of_sum({MASS: 1.0}, "N"), found.of_sum({MASS: 1.0, ZERO: 1.0}, "N")
    assert whole.value == pytest.approx(0.8, abs=0.01)
    assert part.sd == pytest.approx(2.0 / math.sqrt(2.0), rel=0.01)
    assert whole.sd < 0.01 * part.sd
    assert part.before == (0.0, 2.0)


def test_two_recordings_say_more_than_one_and_their_own_disturbances_stay_apart() -> None:
    rng = np.random.default_rng(4)
    first = _evidence({MASS: 1.0, NONE: 2.0}, rng.normal(size=(40, 2)), 0.5, MASS, NONE)
    second = _evidence({MASS: 1.0, NONE: -2.0}, rng.normal(size=(40, 2)), 0.5, MASS, NONE)
    alone = Posterior.of([first]).of_sum({MASS: 1.0}, "kg")
    both = Posterior.of([first, second]).of_sum({MASS: 1.0}, "kg")
    assert both.sd < 0.8 * alone.sd
    assert both.value == pytest.approx(1.0, abs=2.0 * both.sd)


def test_what_no_recording_shows_keeps_its_prior() -> None:
    found = Posterior.of([_evidence({MASS: 1.0}, np.zeros((5, 1)), 0.5, MASS)])
    number = found.of_sum({MASS: 3.0}, "kg")
    assert number.value == 0.0 and number.before == (0.0, 6.0)
    assert not number.shown
