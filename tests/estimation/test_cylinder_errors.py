"""What the whole-body estimate has learnt of its cylinders: how it makes up a force."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from testbed.estimation.live import unknowns
from testbed.estimation.live.body_records import BodyBelief, BodyState
from testbed.estimation.live.cylinder_errors import (
    HELD_BACK,
    force_error,
    forget_touchdown,
    learn_in_air,
    leg_variance,
    reported_variance,
    spread_variance,
    write_cylinder_weights,
    write_leg_weights,
)


@pytest.fixture
def state() -> Any:
    """All unknowns drawn; cylinder 4 slides out, 5 rests half way to sliding in, loaded aside."""
    made = BodyState.zeros()[0]
    made.fusion.x[:] = np.random.default_rng(3).normal(0.0, 100.0, unknowns.COUNT)
    made.axes[4].use, made.axes[5].use, made.axes[5].across = 1.0, -0.5, 0.2
    return made


def test_what_a_sliding_cylinder_is_off_by_is_zero_friction_of_its_way_and_deviation(
    state: Any,
) -> None:
    unknown = state.fusion.x
    own = unknown[unknowns.ZERO + 4] + unknown[unknowns.OUT + 4] + unknown[unknowns.DEVIATION + 4]
    assert force_error(4, state) == pytest.approx(own)


def test_at_rest_only_the_share_that_friction_is_used_of_counts(state: Any) -> None:
    unknown = state.fusion.x
    friction = -0.5 * unknown[unknowns.BACK + 5] - 0.5 * 0.2 * unknown[unknowns.SIDE + 5]
    own = unknown[unknowns.ZERO + 5] + friction + unknown[unknowns.DEVIATION + 5]
    assert force_error(5, state) == pytest.approx(own)


@pytest.mark.parametrize("cylinder", [4, 5])
def test_the_row_of_an_observation_times_the_unknowns_is_what_was_learnt(
    state: Any, cylinder: int
) -> None:
    row = np.zeros(unknowns.COUNT)
    write_cylinder_weights(cylinder, 2.0, state.axes[cylinder], row)
    assert row @ state.fusion.x == pytest.approx(2.0 * force_error(cylinder, state))


def test_a_legs_variance_is_that_of_its_row_and_deaf_to_the_other_legs(state: Any) -> None:
    row = np.zeros(unknowns.COUNT)
    write_leg_weights(1, np.array([0.3, -1.0, 0.7]), state, row)
    root = np.random.default_rng(4).normal(size=(unknowns.COUNT, unknowns.COUNT))
    assert leg_variance(root @ root.T, row, 1) == pytest.approx(row @ root @ root.T @ row)
    assert leg_variance(root @ root.T, row, 2) == 0.0


@pytest.mark.parametrize(
    ("has_slid", "reported_share", "share"), [(0.0, 0.8, 0.75 * 0.7), (1.0, 0.4, 0.75)]
)
def test_of_what_constants_and_friction_make_each_its_share_is_told(
    state: Any, has_slid: float, reported_share: float, share: float
) -> None:
    """A zero of 30 N and friction of 40 N at one cylinder, beside 15 N of the filtered load; the
    spread takes the same share of both.
    """
    body = BodyBelief.zeros()[0]
    body.spread_share, body.spread_stuck, body.noise_sd = 0.75, 0.7, 15.0
    body.reported.stuck, body.reported.stopped, body.reported.resting = 0.8, 0.4, 1.2
    body.reported.loaded_within = body.reported.led_within = 1.0
    state.doubt, state.axes[5].has_slid = 1.0, has_slid
    zero, friction = unknowns.ZERO + 5, unknowns.DEVIATION + 5
    state.fusion.p[zero, zero] = state.fusion.fixed[zero, zero] = 900.0
    state.fusion.p[friction, friction] = 1600.0
    row = np.zeros(unknowns.COUNT)
    row[zero] = row[friction] = 1.0
    told = reported_variance(1, row, body, state)
    assert told == pytest.approx(1.2**2 * 900.0 + reported_share**2 * 1600.0 + 225.0)
    assert spread_variance(1, row, body, state) == pytest.approx(share**2 * 2500.0 + 225.0)
    state.doubt = 1e12  # a balance that nobody believes: all of it, either way
    assert reported_variance(1, row, body, state) == pytest.approx(2725.0)
    assert spread_variance(1, row, body, state) == pytest.approx(2725.0)


def in_the_air(state: Any, balances: int, load_n: float) -> None:
    """Let foot 1 seem to bear so much for so many balances, its vertical piston sliding out."""
    body = BodyBelief.zeros()[0]
    body.air_sd, body.gate = 40.0, 8.0
    state.axes[5].slides, state.axes[5].use = 1.0, 1.0
    state.means.foot_force[1, 2] = load_n
    for _ in range(balances):
        learn_in_air(1, np.eye(3), body, state)


def nothing_known(zero_n: float = 100.0) -> Any:
    """A state of which nothing is learnt yet; the friction of foot 1 out is off by `zero_n` too."""
    state = BodyState.zeros()[0]
    for unknown in (unknowns.ZERO + 5, unknowns.OUT + 5, unknowns.DEVIATION + 5):
        state.fusion.p[unknown, unknown] = zero_n**2
        state.fusion.fixed[unknown, unknown] = zero_n**2 if unknown < unknowns.DEVIATION else 0.0
    return state


@pytest.mark.parametrize("touching", [1, HELD_BACK // 2, HELD_BACK])
def test_what_a_foot_bore_while_it_came_down_is_not_taken_for_friction(touching: int) -> None:
    state = nothing_known()
    in_the_air(state, 40, 60.0)
    before = np.array(state.fusion.x)
    in_the_air(state, HELD_BACK - touching, 60.0)
    in_the_air(state, touching, 900.0)
    assert np.abs(state.fusion.x - before).max() > 0.5
    forget_touchdown(1, state)
    np.testing.assert_array_equal(state.fusion.x, before)


def test_a_foot_that_stays_in_the_air_keeps_what_it_taught() -> None:
    state = nothing_known()
    in_the_air(state, 5 * HELD_BACK, 60.0)
    assert force_error(5, state) == pytest.approx(60.0, abs=2.0)
    forget_touchdown(0, state)
    assert force_error(5, state) == pytest.approx(60.0, abs=2.0)


def test_a_swing_shorter_than_what_is_held_back_teaches_nothing() -> None:
    state = nothing_known()
    in_the_air(state, HELD_BACK - 1, 60.0)
    forget_touchdown(1, state)
    assert not state.fusion.x.any()
