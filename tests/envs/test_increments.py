"""What an action adds to the trim, and how far."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.control.layers.trim import Trim
from testbed.envs.increments import (
    INCREMENTS,
    OFFSET_RANGE_M,
    OFFSET_STEP_M,
    PULL_RANGE_N,
    PULL_STEP_N,
    increase,
    increased,
)


@pytest.fixture
def trim() -> Trim:
    trim = Trim()
    trim.pull_n = np.array([10_000.0, 12_000.0])
    return trim


@pytest.mark.parametrize("index", range(len(INCREMENTS)))
def test_a_row_of_the_action_moves_the_order_of_its_own_name_alone(trim: Trim, index: int) -> None:
    before = increased(trim)
    increase(trim, np.eye(len(INCREMENTS))[index])
    moved = {name: value - before[name] for name, value in increased(trim).items()}
    row = INCREMENTS[index]
    mine = row.column.replace("action_", "orders.offset_" if row.unit == "m" else "orders.pull_")
    assert moved.pop(mine) == pytest.approx(row.high)
    assert not any(moved.values())


def test_set_points_stop_at_their_ranges_and_a_rope_never_pushes(trim: Trim) -> None:
    for _ in range(round(PULL_RANGE_N / PULL_STEP_N) + 1):
        increase(trim, np.array([1.0, -1.0, 0.0, 0.0, 1.0, -1.0]))
    assert trim.goal_m == pytest.approx(
        [min(158 * OFFSET_STEP_M, OFFSET_RANGE_M), -158 * OFFSET_STEP_M, 0.0, 0.0]
    )
    assert list(trim.pull_n) == [PULL_RANGE_N, 0.0]
