"""What an action adds to the trim, and how far."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.control.gait import amounts
from testbed.control.layers import Trim
from testbed.envs.observations import (
    INCREMENTS,
    OFFSET_RANGE_M,
    OFFSET_STEP_M,
    PULL_STEP_N,
    increase,
    increased,
)
from testbed.machine.build import build_machine

MACHINE = build_machine()
RATING_N = MACHINE.traction.rating_n


@pytest.fixture
def trim() -> Trim:
    trim = Trim()
    trim.pull_n = np.array([10_000.0, 12_000.0])
    return trim


@pytest.mark.parametrize("index", range(len(INCREMENTS)))
def test_a_row_of_the_action_moves_the_order_of_its_own_name_alone(trim: Trim, index: int) -> None:
    before = increased(trim)
    increase(trim, amounts(np.eye(len(INCREMENTS))[index], INCREMENTS), MACHINE)
    moved = {name: value - before[name] for name, value in increased(trim).items()}
    row = INCREMENTS[index]
    mine = row.column.replace("action_", "orders.offset_" if row.unit == "m" else "orders.pull_")
    assert moved.pop(mine) == pytest.approx(row.high)
    assert not any(moved.values())


def test_set_points_stop_at_their_ranges_and_a_rope_never_pushes(trim: Trim) -> None:
    by = amounts(np.array([1.0, -1.0, 0.0, 0.0, 1.0, -1.0]), INCREMENTS)
    for _ in range(round(RATING_N / PULL_STEP_N) + 1):
        increase(trim, by, MACHINE)
    assert trim.goal_m == pytest.approx(
        [min(158 * OFFSET_STEP_M, OFFSET_RANGE_M), -158 * OFFSET_STEP_M, 0.0, 0.0]
    )
    assert list(trim.pull_n) == [RATING_N, 0.0]
