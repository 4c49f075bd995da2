"""When pistons slide within a bin, and what their seals still hold while they turn round."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.diagnosis.robot.bins import Frame, sense_in_time, slid_on
from testbed.diagnosis.robot.friction import BEHIND, sense_of_friction
from testbed.diagnosis.robot.motion_noise import turning_from

PARTS, PART_S = 5, 0.02
FAST, SLOW = 0.02, 0.002
"""m/s: a slide, and one of which a bin shows two counts at most."""


def sense(*speeds: float) -> float:
    """Of the first bin, by the speeds in the parts of each, m/s."""
    within = np.array(speeds, dtype=float).reshape(-1, PARTS, 1)
    return float(sense_in_time(within, PART_S, 1.0)[0, 0])


def test_a_piston_slides_for_the_part_of_a_bin_in_which_it_moves() -> None:
    assert sense(FAST, FAST, FAST, FAST, FAST) == pytest.approx(1.0)
    assert sense(0.0, 0.0, 0.0, 0.0, FAST) == pytest.approx(0.2)
    assert sense(-FAST, -FAST, 0.0, 0.0, 0.0) == pytest.approx(-0.4)
    assert sense(FAST, FAST, FAST, -FAST, -FAST) == pytest.approx(0.2)


def test_friction_has_the_sense_of_the_longer_time_and_not_of_the_longer_way() -> None:
    assert sense(FAST, FAST, FAST, -3.0 * FAST, -3.0 * FAST) == pytest.approx(0.2)


def test_a_piston_that_slides_slowly_slides_wholly_and_one_that_makes_a_count_rests() -> None:
    assert sense(*[SLOW] * 2 * PARTS) == pytest.approx(1.0)
    assert sense(0.0, 0.0, 0.0, SLOW, SLOW, *[SLOW] * PARTS, SLOW, *[0.0] * 4) == pytest.approx(0.4)
    assert sense(0.0, 0.0, 0.005, 0.0, 0.0) == pytest.approx(0.0)


def test_pistons_of_one_sense_side_by_side_are_no_one_slide() -> None:
    within = np.full((1, PARTS, 2), SLOW)
    assert sense_in_time(within, PART_S, 1.0).tolist() == [[0.0, 0.0]]
    assert sense_in_time(2.0 * within, PART_S, 1.0).tolist() == [[1.0, 1.0]]


def test_an_encoder_that_goes_on_now_and_then_shows_slow_sliding() -> None:
    assert sense(0.01, 0.0, 0.0, 0.0, 0.01) == pytest.approx(1.0)
    counts = np.array([0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0])[:, None]
    assert slid_on(counts, 3)[:, 0].tolist() == [0, 1, 1, 1, 1, 0, 0, 0, 1, 0, -1, 0]
    assert slid_on(-counts, 4)[:, 0].tolist() == [0, -1, -1, -1, -1, -1, -1, -1, -1, 0, 1, 0]


def test_speeds_within_a_bin_have_its_mean_speed_as_their_mean() -> None:
    for hertz in (1000.0, 200.0):
        time = np.arange(0.0, 3.0, 1.0 / hertz)
        frame = Frame.of(time)
        found = frame.speeds_within(0.03 * time**2)
        assert found.shape == (frame.count, PARTS)
        assert found.mean(axis=1) == pytest.approx(frame.mean(0.06 * time), rel=0.01)


def test_a_seal_is_behind_while_its_piston_turns_round_and_nowhere_else() -> None:
    goes = np.array([1.0, 1.0, 1.0, 1.0, 0.0, -1.0, -1.0, -1.0, -1.0])[:, None]
    assert turning_from(goes)[:, 0].tolist() == [0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 0.5, 0.0, 0.0]
    found = sense_of_friction(goes)
    assert found[4, 0] == pytest.approx(BEHIND)
    assert np.delete(found, 4, axis=0) == pytest.approx(np.delete(goes, 4, axis=0))
    assert sense_of_friction(-goes) == pytest.approx(-found)
