"""How a foot finds the ground, and how standing feet keep the body level, with numbers by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from testbed.control.gait import Measured
from testbed.control.gaits.crawl.known_ground import ExpectedGround
from testbed.control.gaits.crawl.posture import LEVEL_GAIN_1_S, Levelling
from testbed.control.gaits.crawl.swing import BASE_TIME_S, STEADY_S, GroundSearch, Haste

DT = 0.01
EVEN, STAND = [7000.0] * 4, (True, True, True, True)
FEET = np.array([[1.2, 1.0, -0.4], [1.2, -1.0, -0.4], [-1.2, 1.0, -0.4], [-1.2, -1.0, -0.4]])


def test_the_ground_is_sought_in_proportion_to_what_the_feet_carry() -> None:
    flat, steep, wall = (
        GroundSearch(4e4 * math.cos(a), math.cos(a), 0.1) for a in np.radians([0.0, 60.0, 89.0])
    )
    rough, plane, usual = ExpectedGround(0.0, 0.1), ExpectedGround(0.0, 0.0), Haste()
    assert flat.speed_m_s(0.0, rough, usual) == pytest.approx(0.06)
    assert steep.speed_m_s(0.0, rough, usual) == pytest.approx(0.03)
    assert wall.speed_m_s(0.0, rough, usual) == 0.01
    assert steep.speed_m_s(0.061, rough, usual) == pytest.approx(0.08 * math.sqrt(0.5)), (
        "half of what the ground may lie higher"
    )
    hasty = Haste(near=2.0, far=1.5)
    assert steep.speed_m_s(0.061, rough, hasty) == 1.5 * steep.speed_m_s(0.061, rough, usual)
    assert steep.speed_m_s(0.0, rough, hasty) == 2.0 * steep.speed_m_s(0.0, rough, usual)
    assert steep.speed_m_s(0.0, plane, hasty) == steep.speed_m_s(0.0, plane, usual), (
        "where it is met at once a touch is as soft"
    )
    reckless = Haste(near=9.0, far=1.5)
    assert steep.speed_m_s(0.0, rough, reckless) == steep.speed_m_s(0.061, rough, reckless), (
        "no faster than far above it"
    )
    in_time = Haste(most_s=0.25)
    assert wall.speed_m_s(0.0, plane, in_time) == pytest.approx(0.04), "the last 10 mm in 0.25 s"
    assert flat.speed_m_s(0.0, plane, in_time) == flat.speed_m_s(0.0, plane, usual), "in less"
    assert wall.speed_m_s(0.0, rough, in_time) == wall.speed_m_s(0.0, rough, usual), (
        "ground that may lie higher is met later"
    )
    known = ExpectedGround(height_m=-0.4, steps_m=0.02)
    assert steep.first_m(known) == pytest.approx(-0.37)
    assert steep.first_m(known, 0.5) == pytest.approx(-0.38)
    assert steep.lowest_m(known) == pytest.approx(-0.56), "all of the ground's steps below"


def test_a_foot_is_lifted_over_what_the_ground_may_rise_by_or_over_what_is_expected() -> None:
    search = GroundSearch(4e4, 1.0, 0.1)
    rough, plane = ExpectedGround(0.0, 0.1), ExpectedGround(0.0, 0.0)
    assert search.high_m(0.0, rough, 0.05, over=True) == pytest.approx(0.16)
    assert search.high_m(0.0, rough, 0.05, over=False) == pytest.approx(0.11), "clear of all of it"
    assert search.high_m(0.0, rough, 0.15, over=False) == pytest.approx(0.16)
    for over in (True, False):
        assert search.high_m(0.0, plane, 0.05, over=over) == pytest.approx(0.06)
        assert search.high_m(0.3, plane, 0.05, over=over) == pytest.approx(0.35), "off a high print"


def test_a_touch_is_a_rise_above_what_the_foot_weighed_in_the_air() -> None:
    search = GroundSearch(1e4, 0.25, 0.0)
    assert search.touch_n == pytest.approx(1200.0)
    search.begin(500.0)
    assert not search.met(1650.0, STEADY_S, DT)
    learnt = 500.0 + 1150.0 * DT / BASE_TIME_S
    assert search.met(learnt + 1201.0, STEADY_S, DT) and not search.met(
        learnt + 1199.0, STEADY_S, DT
    )
    search.begin(0.0)
    assert not search.met(1400.0, 0.0, DT), "friction still turns over"
    search.begin(0.0)
    assert search.met(1501.0, 0.0, DT)


def _moved(
    start: list[float], now: list[float], load_n: list[float], standing: tuple[bool, ...] = STAND
) -> np.ndarray:
    """How far the feet of a body are moved that stood at attitude `start` and now is at `now`,
    rad.
    """
    levelling, feet = Levelling(np.array(start), 1.0), FEET.copy()
    levelling.stand_on(feet)
    measured = Measured.of(load=load_n, contact=1.0, attitude=now)
    levelling.correct(feet, np.zeros(3), np.array(standing), measured, False, DT)
    return feet - FEET


def test_a_body_that_leans_is_turned_back_by_its_standing_feet() -> None:
    """Nose down: the front legs lengthen, their feet go down in the body. Left side up: the left
    legs shorten.
    """
    moves = _moved([0.0, -0.7, 0.0], [0.0, -0.69, 0.0], EVEN)  # the front went down by 0.01 rad
    np.testing.assert_allclose(moves[:, 2], -0.01 * LEVEL_GAIN_1_S * DT * FEET[:, 0], rtol=1e-3)
    np.testing.assert_allclose(moves[:, :2], 0.0, atol=1e-9)
    rolled = _moved([0.0, 0.0, 0.0], [0.01, 0.0, 0.0], EVEN)
    np.testing.assert_allclose(rolled[:, 2], 0.01 * LEVEL_GAIN_1_S * DT * FEET[:, 1], rtol=1e-3)


def test_a_foot_in_the_air_is_left_to_its_swing() -> None:
    moves = _moved(
        [0.0, 0.0, 0.0], [0.01, 0.0, 0.02], [9000.0, 5000.0, 5000.0, 0.0], (True, True, True, False)
    )
    assert not moves[3].any()
    np.testing.assert_allclose(moves[:3, 0], -0.02 * LEVEL_GAIN_1_S * DT * FEET[:3, 1], rtol=1e-2)


def test_a_diagonal_that_carries_too_much_is_shortened_without_a_tilt() -> None:
    level = [0.0, 0.0, 0.0]
    np.testing.assert_allclose(_moved(level, level, EVEN), 0.0, atol=1e-15)
    heights = _moved(level, level, [9000.0, 5000.0, 5000.0, 9000.0])[:, 2]
    np.testing.assert_allclose([heights.sum(), *(heights @ FEET[:, :2])], 0.0, atol=1e-15)
    assert heights[0] > 0.0 and heights[1] < 0.0
