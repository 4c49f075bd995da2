"""From errors of joint forces to rates: what is small rests, what lasts grows, what hangs seeks the
ground.
"""

from __future__ import annotations

import numpy as np
import pytest

from testbed.control.distribution.distribution import (
    EDGE_LIMIT,
    GAIN_1_S,
    add_internal_force,
    add_pull,
    internal_force_state,
)
from testbed.machine.names import LEGS
from testbed.machine.scale import ROBOCLIMBER, Scale

BY = internal_force_state(ROBOCLIMBER)
DT_S = 0.01
COMPLIANCE = np.full(12, 1.0e-7)
LOADED = np.tile([5_000.0, 0.0, 0.0], len(LEGS))


def squeezed(force: np.ndarray, edges: np.ndarray, ticks: int = 1, felt: float = 5_000.0):
    """Rates (12) of the last of so many ticks."""
    rates = np.zeros(12)
    for _ in range(ticks):
        rates[:] = 0.0
        add_internal_force(
            force, COMPLIANCE, felt / 5_000.0 * LOADED, LOADED, DT_S, BY, edges, rates
        )
    return rates


def fresh() -> np.ndarray:
    return np.vstack([np.ones(12), np.zeros(12)])


def test_errors_within_a_tenth_of_friction_are_left_alone() -> None:
    assert not squeezed(0.99 * BY.tolerance, fresh()).any()
    assert (squeezed(1.01 * BY.tolerance, fresh()) > 0.0).all()


def test_the_rate_takes_the_error_off_at_its_gain_beyond_the_dead_band() -> None:
    force = np.zeros(12)
    force[2] = -3_000.0
    rates = squeezed(force, fresh())
    assert rates[2] == pytest.approx(-(GAIN_1_S * 1.0e-7 * 3_000.0 + BY.edge_start[2]))
    assert np.count_nonzero(rates) == 1


def test_no_error_moves_a_joint_faster_than_its_limit() -> None:
    rates = squeezed(np.full(12, 1.0e9), fresh())
    assert rates == pytest.approx(BY.speed_limit)


def test_where_nothing_comes_the_dead_band_is_taken_wider_up_to_its_most() -> None:
    force, edges = np.full(12, 2_000.0), fresh()
    first, later = squeezed(force, edges), squeezed(force, edges, ticks=50)
    assert (later > first).all()
    squeezed(force, edges, ticks=2_000)
    assert edges[0] == pytest.approx(EDGE_LIMIT)


def test_an_error_that_turns_round_or_ends_starts_small_again() -> None:
    force, edges = np.full(12, 2_000.0), fresh()
    squeezed(force, edges, ticks=2_000)
    squeezed(-force, edges)
    assert edges[0] == pytest.approx(0.7 * EDGE_LIMIT) and (edges[1] == -1.0).all()
    squeezed(np.zeros(12), edges)
    assert (edges[0] == 1.0).all() and not edges[1].any()


def test_a_foot_that_hangs_is_let_down_whatever_the_forces_say() -> None:
    rates = squeezed(np.zeros(12), fresh(), felt=1_000.0)
    assert rates[2::3] == pytest.approx(BY.seek_m_s)
    assert not rates[0::3].any() and not rates[1::3].any()


def test_a_wanted_pull_is_followed_at_its_slew_and_the_rope_hauls_what_lacks() -> None:
    pull, rates = np.array([10_000.0, 10_000.0]), np.zeros(2)
    tension = pull.copy()
    add_pull(np.array([20_000.0, 10_010.0]), tension, DT_S, BY, pull, rates)
    assert pull == pytest.approx([10_000.0 + BY.pull_slew_n_s * DT_S, 10_010.0])
    for _ in range(1_000):
        add_pull(np.array([20_000.0, 10_010.0]), tension, DT_S, BY, pull, rates)
    assert pull == pytest.approx([20_000.0, 10_010.0])
    assert rates[0] < 0.0  # negative hauls in


@pytest.mark.parametrize("mass_kg", [80.0, 8_000.0])
def test_a_machine_of_another_size_squeezes_as_its_forces_and_speeds_do(mass_kg: float) -> None:
    scale = Scale.of(mass_kg)
    other = internal_force_state(scale)
    assert other.tolerance[1::3] == pytest.approx(scale.force * BY.tolerance[1::3])
    assert other.tolerance[0::3] == pytest.approx(scale.moment * BY.tolerance[0::3])
    assert other.speed_limit[2::3] == pytest.approx(scale.speed * BY.speed_limit[2::3])
    assert other.speed_limit[0::3] == pytest.approx(BY.speed_limit[0::3] / scale.speed)
    assert other.seek_m_s == pytest.approx(scale.speed * BY.seek_m_s)
