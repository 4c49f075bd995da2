"""A quiet stand: nothing of the foot loads is the engine's."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.benchmarks.climbs.stands import LOCKED, NO_LEAKAGE, foot_loads

QUARTER_WEIGHT_N = 4000.0 * 9.81 / 4


@pytest.mark.slow
def test_foot_loads_are_the_same_at_1_and_4_khz() -> None:
    slow, fast = foot_loads(LOCKED, 1000, 5.0), foot_loads(LOCKED, 4000, 5.0)
    assert np.abs(slow - fast).max() < 0.02 * QUARTER_WEIGHT_N


def test_locked_and_tight_cylinders_hold_their_loads_still() -> None:
    """Without leakage nothing may move once the start's bounce is over: the engine's contacts must
    not wander.
    """
    loads = foot_loads(LOCKED + NO_LEAKAGE, 1000, 3.0)[100:]
    assert np.ptp(loads, axis=0).max() < 1.0


def test_feet_and_ropes_carry_what_the_start_balance_says() -> None:
    """45 degrees, 90 % of the pull along the slope in the ropes: hand-computed sum of the foot
    loads.

    Across the slope: W cos 45 = 27747 N, less what the ropes lift. They run from 0.67 m above the
    ground (0.33 m over the platform's centre, which is 0.41 m over the ground, so 0.74 m) to 0.5 m
    at the anchors: they pull down slightly.
    """
    loads = foot_loads(LOCKED, 1000, 0.5)
    along = 0.9 * 4000.0 * 9.81 * np.sin(np.pi / 4)
    down = along * (0.74 - 0.5) / (30.0 - 1.05)
    assert loads.mean(axis=0).sum() == pytest.approx(
        4000.0 * 9.81 * np.cos(np.pi / 4) + down, rel=2e-3
    )
