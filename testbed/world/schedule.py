"""What is due after which step: every part of the loop has a period of its own."""

from __future__ import annotations

import math
from dataclasses import dataclass

from testbed.scenario.scenario import Scenario
from testbed.world.between import (
    CONTROL,
    ESTIMATE,
    FEET,
    MOVE,
    PLANT,
    RECORD,
    SENSE,
    SLOW,
)

TICK_HZ = 100


@dataclass(frozen=True)
class Schedule:
    """Periods in physics steps."""

    flags: tuple[int, ...]
    """What is due after step k, as flags for between_steps: entry k modulo the length."""
    tick: int
    """The slow tick: events, drill, gait, judge, ground."""
    expected: int
    """Foot loads that the model expects."""
    sensor: int
    record: int
    last: int
    """Number of the last step, a tick."""


def schedule_of(scenario: Scenario, chain_is_all: bool) -> Schedule:
    """The schedule of a scenario; `chain_is_all`: the compiled chain steps every estimate."""
    rates, hz = scenario.rates, scenario.rates.physics_hz
    tick = max(1, hz // TICK_HZ)
    every = {
        SENSE: hz // rates.sensor_hz,
        ESTIMATE: hz // rates.estimator_hz,
        RECORD: hz // rates.record_hz,
        CONTROL: hz // rates.control_hz,
        PLANT: 1,
        MOVE: 1,
        FEET: 1,
    }
    slow = [tick, hz // rates.expected_loads_hz]
    if not chain_is_all:
        slow.append(every[ESTIMATE])
    flags = tuple(
        sum(flag for flag, steps in every.items() if k % steps == 0)
        | (SLOW if any(k % steps == 0 for steps in slow) else 0)
        for k in range(math.lcm(*every.values(), *slow))
    )
    last = math.ceil(scenario.duration_s * hz / tick - 1e-9) * tick
    return Schedule(flags, tick, slow[1], every[SENSE], every[RECORD], last)
