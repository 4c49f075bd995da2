"""How far the level of a bench's friction is shifted with the pressure, from few unlike runs."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.diagnosis.leg.pressure_level import (
    CONSTANT,
    OWN,
    RISK,
    TREND,
    TREND_SD,
    Levels,
    expected,
    safe_shifts_n,
)

BAR = 1e5
FRICTION_N = 10.0
RUNS_PA = np.array([1.0, 3.0, 7.0]) * BAR


def _levels(level_n: np.ndarray, pressure_pa: np.ndarray = RUNS_PA) -> Levels:
    return Levels(pressure_pa, np.asarray(level_n, dtype=np.float64), FRICTION_N)


def _straight(trend_n: float, pressure_pa: np.ndarray = RUNS_PA) -> np.ndarray:
    """Levels about their mean, by so much at one mean pressure above it."""
    return trend_n * (pressure_pa / RUNS_PA.mean() - 1.0)


def test_levels_on_a_straight_line_are_expected_on_it() -> None:
    seen = expected(_levels(_straight(6.0)), np.array([2.0, 5.0]) * BAR)
    line = _straight(6.0, np.array([2.0, 5.0]) * BAR)
    assert seen.overall_n() == pytest.approx(line, abs=0.4)
    assert seen.probability.sum() == pytest.approx(1.0)


def test_a_steep_trend_is_followed_and_one_within_the_wander_of_runs_is_not() -> None:
    steep, slight = (
        safe_shifts_n(_levels(_straight(trend_n)), [RUNS_PA[0]], 0.0)[0] for trend_n in (8.0, 0.5)
    )
    assert steep == pytest.approx(_straight(8.0)[0], rel=0.3)
    assert slight == pytest.approx(0.0)


def test_beyond_the_runs_pressures_a_shift_is_no_larger_than_at_their_edge() -> None:
    edge, beyond, far = safe_shifts_n(
        _levels(_straight(8.0)), [7.0 * BAR, 9.0 * BAR, 40.0 * BAR], 0.0
    )
    assert 0.0 < beyond <= edge and 0.0 <= far <= edge


def test_what_the_course_gains_makes_room_for_a_shift() -> None:
    levels = _levels(_straight(2.5))
    without, little, much = (
        abs(safe_shifts_n(levels, [RUNS_PA[2]], room)[0]) for room in (0.0, 0.1, 2.0)
    )
    assert without < little < much


def test_a_further_run_errs_more_than_identified_as_seldom_as_is_said() -> None:
    rng = np.random.default_rng(5)
    rigs, worse, gained = 300, 0, []
    for _ in range(rigs):
        own = rng.choice(OWN) * FRICTION_N
        trend = rng.normal(TREND, TREND_SD) * FRICTION_N
        pressures = np.append(RUNS_PA, rng.choice([2.0, 5.0, 9.0]) * BAR)
        truth = _straight(trend, pressures) + rng.normal(0.0, CONSTANT * FRICTION_N)
        *runs, further = truth + rng.normal(0.0, own, len(pressures))
        shift = safe_shifts_n(_levels(np.array(runs)), [pressures[-1]], 0.0)[0]
        worse += abs(further - shift) > abs(further)
        gained.append(further**2 - (further - shift) ** 2)
    assert worse <= 2.0 * RISK * rigs
    assert np.mean(gained) > 0.0
