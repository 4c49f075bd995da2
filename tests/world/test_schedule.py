"""What is due after which step, counted by hand."""

from __future__ import annotations

import pytest

from testbed.scenario.parts import Rates
from testbed.world.compiled_step import (
    CONTROL,
    ESTIMATE,
    FEET,
    MOVE,
    PLANT,
    RECORD,
    SENSE,
    SLOW,
    Schedule,
    schedule_of,
)

EVERY_STEP = PLANT | MOVE | FEET
RATES = Rates(
    physics_hz=1000,
    sensor_hz=500,
    estimator_hz=250,
    control_hz=200,
    record_hz=100,
    expected_loads_hz=10,
)


def due(schedule: Schedule, step: int) -> int:
    return schedule.flags[step % len(schedule.flags)]


def test_each_part_is_due_at_its_rate_and_no_other_time() -> None:
    schedule = schedule_of(RATES, 1.0, chain_is_all=True)
    assert len(schedule.flags) == 100  # the slowest, ten times a second
    for flag, times in ((SENSE, 50), (ESTIMATE, 25), (CONTROL, 20), (RECORD, 10), (SLOW, 10)):
        steps = [k for k in range(100) if due(schedule, k) & flag]
        assert steps == list(range(0, 100, 100 // times))
    assert all(flags & EVERY_STEP == EVERY_STEP for flags in schedule.flags)


def test_what_the_chain_does_not_step_itself_makes_every_estimate_a_slow_step() -> None:
    schedule = schedule_of(RATES, 1.0, chain_is_all=False)
    assert [k for k in range(20) if due(schedule, k) & SLOW] == [0, 4, 8, 10, 12, 16]


@pytest.mark.parametrize(
    ("duration_s", "last"), [(1.0, 1000), (0.001, 10), (0.0101, 20), (1e-12, 10)]
)
def test_a_run_ends_with_a_whole_tick_however_short_it_is(duration_s: float, last: int) -> None:
    assert schedule_of(RATES, duration_s, chain_is_all=True).last == last


def test_periods_are_told_in_physics_steps() -> None:
    schedule = schedule_of(RATES, 1.0, chain_is_all=True)
    assert (schedule.tick, schedule.expected, schedule.sensor, schedule.record) == (10, 100, 2, 10)
