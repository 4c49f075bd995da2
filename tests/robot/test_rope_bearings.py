"""Where ropes lead after a walk: the way is that of the feet that stood, and the anchors stay where
they are.
"""

from __future__ import annotations

import numpy as np
import pytest

from testbed.robot.rope_bearings import NO_ROPES, RopeBearings, SurveyedRopes, follow

ANCHORS = np.array([[30.0, 6.0, 1.0], [30.0, -6.0, 1.0]])
FEET = np.array([[1.0, 1.0, -0.8], [1.0, -1.0, -0.8], [-1.0, 1.0, -0.8], [-1.0, -1.0, -0.8]])
STRIDE = np.array([0.4, 0.1, 0.02])


def walked(ropes: SurveyedRopes, strides: int, wrong: np.ndarray | None = None) -> RopeBearings:
    """After so many strides of the body over standing feet, each foot set forward alone in between.
    `wrong` (4, 3): what is added to the feet that swing.
    """
    bearings, body = RopeBearings.zeros(), np.zeros(3)
    feet = FEET.copy()
    for _ in range(strides):
        for share in np.linspace(0.0, 1.0, 5):
            seen = feet - body - share * STRIDE
            follow(ropes.directions, ropes.distances_m, seen, np.ones(4), bearings[0])
        body = body + STRIDE
        for leg in range(4):
            stands = np.ones(4)
            stands[leg] = 0.0
            feet[leg] += STRIDE
            swings = feet - body
            swings[leg] += 0.0 if wrong is None else wrong[leg]
            follow(ropes.directions, ropes.distances_m, swings, stands, bearings[0])
    return bearings[0]


def test_after_a_walk_the_ropes_lead_to_the_same_anchors() -> None:
    found = walked(SurveyedRopes.along(ANCHORS), 20)
    np.testing.assert_allclose(found["way"], 20 * STRIDE, atol=1e-12)
    ways = ANCHORS - 20 * STRIDE
    expected = ways / np.linalg.norm(ways, axis=1)[:, None]
    np.testing.assert_allclose(found["direction"], expected, atol=1e-12)
    turned = np.degrees(np.arccos(np.sum(expected * SurveyedRopes.along(ANCHORS).directions, 1)))
    assert turned.max() > 5.0, "a walk that hardly turns them would show nothing"


@pytest.mark.parametrize("wrong", [1e3, np.nan])
def test_a_foot_in_the_air_says_nothing(wrong: float) -> None:
    found = walked(SurveyedRopes.along(ANCHORS), 3, np.full((4, 3), wrong))
    np.testing.assert_allclose(found["way"], 3 * STRIDE, atol=1e-9)


def test_ropes_of_a_length_that_nobody_knows_are_taken_not_to_turn() -> None:
    ropes = SurveyedRopes.leading(SurveyedRopes.along(ANCHORS).directions)
    np.testing.assert_allclose(walked(ropes, 5)["direction"], ropes.directions, atol=1e-15)


def test_without_ropes_nothing_leads_anywhere() -> None:
    assert not walked(NO_ROPES, 2)["direction"].any()


def test_a_survey_in_another_frame_is_the_same_survey() -> None:
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    ropes = SurveyedRopes.along(ANCHORS)
    other = SurveyedRopes.along(ANCHORS @ quarter.T)
    np.testing.assert_allclose(ropes.turned(quarter).table, other.table, atol=1e-12)
    np.testing.assert_array_equal(SurveyedRopes.of_table(ropes.table).table, ropes.table)
