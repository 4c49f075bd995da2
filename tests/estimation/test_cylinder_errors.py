"""What the whole-body estimate has learnt of its cylinders: how it makes up a force."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from testbed.estimation.live import fusion as fu
from testbed.estimation.live.body_records import BodyBelief, BodyState
from testbed.estimation.live.cylinder_errors import (
    force_error,
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
    made.fusion.x[:] = np.random.default_rng(3).normal(0.0, 100.0, fu.N)
    made.axes[4].use, made.axes[5].use, made.axes[5].across = 1.0, -0.5, 0.2
    return made


def test_what_a_sliding_cylinder_is_off_by_is_zero_friction_of_its_way_and_deviation(
    state: Any,
) -> None:
    unknown = state.fusion.x
    own = unknown[fu.ZERO + 4] + unknown[fu.OUT + 4] + unknown[fu.DEVIATION + 4]
    assert force_error(4, state) == pytest.approx(own)


def test_at_rest_only_the_share_that_friction_is_used_of_counts(state: Any) -> None:
    unknown = state.fusion.x
    friction = -0.5 * unknown[fu.BACK + 5] - 0.5 * 0.2 * unknown[fu.SIDE + 5]
    own = unknown[fu.ZERO + 5] + friction + unknown[fu.DEVIATION + 5]
    assert force_error(5, state) == pytest.approx(own)


@pytest.mark.parametrize("cylinder", [4, 5])
def test_the_row_of_an_observation_times_the_unknowns_is_what_was_learnt(
    state: Any, cylinder: int
) -> None:
    row = np.zeros(fu.N)
    write_cylinder_weights(cylinder, 2.0, state.axes[cylinder], row)
    assert row @ state.fusion.x == pytest.approx(2.0 * force_error(cylinder, state))


def test_a_legs_variance_is_that_of_its_row_and_deaf_to_the_other_legs(state: Any) -> None:
    row = np.zeros(fu.N)
    write_leg_weights(1, np.array([0.3, -1.0, 0.7]), state, row)
    root = np.random.default_rng(4).normal(size=(fu.N, fu.N))
    assert leg_variance(root @ root.T, row, 1) == pytest.approx(row @ root @ root.T @ row)
    assert leg_variance(root @ root.T, row, 2) == 0.0


@pytest.mark.parametrize(
    ("has_slid", "told_share", "share"), [(0.0, 0.8, 0.75 * 0.7), (1.0, 0.4, 0.75)]
)
def test_all_that_constants_make_is_told_and_of_friction_a_share(
    state: Any, has_slid: float, told_share: float, share: float
) -> None:
    """A zero of 30 N and friction of 40 N at one cylinder, beside 15 N of the filtered load; the
    spread takes the same share of both.
    """
    body = BodyBelief.zeros()[0]
    body.spread_share, body.spread_stuck, body.noise_sd = 0.75, 0.7, 15.0
    body.told.stuck, body.told.stopped = 0.8, 0.4
    body.told.loaded_within = body.told.led_within = 1.0
    state.doubt, state.axes[5].has_slid = 1.0, has_slid
    zero, friction = fu.ZERO + 5, fu.DEVIATION + 5
    state.fusion.p[zero, zero] = state.fusion.fixed[zero, zero] = 900.0
    state.fusion.p[friction, friction] = 1600.0
    row = np.zeros(fu.N)
    row[zero] = row[friction] = 1.0
    told = reported_variance(1, row, body, state)
    assert told == pytest.approx(900.0 + told_share**2 * 1600.0 + 225.0)
    assert spread_variance(1, row, body, state) == pytest.approx(share**2 * 2500.0 + 225.0)
    state.doubt = 1e12  # a balance that nobody believes: all of it, either way
    assert reported_variance(1, row, body, state) == pytest.approx(2725.0)
    assert spread_variance(1, row, body, state) == pytest.approx(2725.0)
