"""Friction of a leg, equation (5), at points computed by hand, and as a set at rest."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from testbed.effects.terms import ForceTerms, Signals
from testbed.estimation.leg.balance import breakaway_n, conditions_over, friction_n
from testbed.recording.known import Known
from testbed.recording.leg_model import Friction

FRICTION = Friction(
    viscous_plus_n_s_m=2000.0,
    coulomb_plus_n=300.0,
    stribeck_plus_n=120.0,
    stribeck_speed_plus_m_s=0.01,
    viscous_minus_n_s_m=1000.0,
    coulomb_minus_n=200.0,
    stribeck_minus_n=80.0,
    stribeck_speed_minus_m_s=0.02,
)


def moving(*speeds: float) -> Signals:
    velocity = np.array(speeds)
    time = np.arange(len(velocity)) / 1000.0
    position = 0.1 + np.cumsum(velocity) / 1000.0
    return Signals(time, 1000.0, Known(), position, velocity, np.zeros(len(velocity)))


def terms(**changes: Any) -> ForceTerms:
    return ForceTerms(80.0, 80.0, **changes)


def test_each_way_has_its_own_numbers() -> None:
    """At 0.02 m/s out: 40 + 300 + 120 / e^2 N; back: 20 + 200 + 80 / e N against it."""
    out, back = friction_n(FRICTION, moving(0.02, -0.02), terms())
    assert out == pytest.approx(40.0 + 300.0 + 120.0 * np.exp(-2.0))
    assert back == pytest.approx(-(20.0 + 200.0 + 80.0 * np.exp(-1.0)))


def test_at_rest_the_value_is_none_and_the_set_reaches_to_the_break_away() -> None:
    assert friction_n(FRICTION, moving(0.0), terms())[0] == 0.0
    low, high = breakaway_n(FRICTION, moving(0.0), terms())
    assert (low[0], high[0]) == pytest.approx((-280.0, 420.0))
    assert FRICTION.breakaway_n == (420.0, 280.0)


@pytest.mark.parametrize(
    ("changes", "more_n"),
    [
        ({"coulomb_scale": 1.5}, 150.0),
        ({"coulomb_add_n": 50.0}, 50.0),
        ({"viscous_scale": 0.5}, -100.0),
        ({"coulomb_scale": 2.0, "coulomb_add_n": -30.0}, 270.0),
    ],
)
def test_an_effect_changes_its_own_part_alone(changes: dict[str, float], more_n: float) -> None:
    before = friction_n(FRICTION, moving(0.1), terms())[0]
    assert friction_n(FRICTION, moving(0.1), terms(**changes))[0] - before == pytest.approx(more_n)


def test_numbers_and_courses_over_time_are_taken_alike() -> None:
    course = terms(coulomb_scale=np.array([1.0, 2.0, 3.0]))
    factor, extra, thinning = conditions_over(moving(0.1, 0.1, 0.1), course)
    assert factor.tolist() == [1.0, 2.0, 3.0]
    assert extra.tolist() == [0.0] * 3 and thinning.tolist() == [1.0] * 3


def test_a_bristle_that_slips_rubs_as_equation_5_says() -> None:
    steady = moving(*[0.01] * 500)
    bent = friction_n(FRICTION, steady, terms(presliding=(1.0e6, 0.0, 1.0)))
    assert bent == pytest.approx(friction_n(FRICTION, steady, terms()), rel=0.01)


def test_a_bristle_turns_round_over_a_way_and_not_at_once() -> None:
    """1 MN/m: from the one level to the other is a way of 0.6 mm; equation (5) jumps."""
    motion = moving(*[0.01] * 500, *[-0.01] * 500)
    bent = friction_n(FRICTION, motion, terms(presliding=(1.0e6, 0.0, 1.0)))
    sharp = friction_n(FRICTION, motion, terms())
    assert bent[500] > 0.0 > sharp[500]
    assert np.abs(np.diff(bent)).max() < 0.3 * np.abs(np.diff(sharp)).max()
    assert bent[-1] == pytest.approx(sharp[-1], rel=0.01)
