"""How hard the drill may press: the thrust that a stance allows before a foot leaves the slope.

On 45 degrees the feet carry 28 kN and a feed of 5.5 kN is nothing to them; on 80 degrees they carry
6.8 kN in all, and what is left of the foot that leaves first is the bound. It is counted once, at
the start stance, from the declared weight, ropes and posture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from testbed.formats.arrays import Array
from testbed.robot.loads.foot_loads import ExpectedLoads
from testbed.scenario.drilling import DrillHole
from testbed.scenario.scenario import Scenario
from testbed.scenario.tasks import Drill


@dataclass(frozen=True)
class ThrustBound:
    """What the start stance allows, N."""

    reserve_n: float
    """Thrust at which the first foot leaves."""
    leg: str | None
    most_n: float
    """What the feed is held to; infinite where the scenario sets no bound."""


def thrust_bound(
    scenario: Scenario,
    expected: ExpectedLoads,
    joints: Array,
    gravity_in_body: Array,
    rope_forces_in_body: Array,
) -> ThrustBound:
    """The bound of a scenario's start stance: joints (12), gravity (3) m/s2, rope forces (2, 3)
    N.
    """
    loads = expected.solve(joints, gravity_in_body, rope_forces_in_body=rope_forces_in_body)
    kept = scenario.control.thrust_reserve
    reserve = loads.unload_reserve_n
    return ThrustBound(
        reserve, loads.unloads_first, np.inf if kept is None else (1.0 - kept) * reserve
    )


def ordered_thrust_n(task: object) -> float:
    """The highest feed that a task asks for, N; 0 for one that does not drill."""
    if isinstance(task, DrillHole):
        return task.feed_n
    if isinstance(task, Drill):
        return max(float(getattr(phase, "feed_n", 0.0)) for phase in task.phases)
    return 0.0


def thrust_events(task: object, bound: ThrustBound) -> list[dict[str, Any]]:
    """An event for the run's list where a task asks for more than the stance has in reserve, else
    none.
    """
    ordered = ordered_thrust_n(task)
    if ordered <= bound.reserve_n:
        return []
    said = {"ordered_n": ordered, "reserve_n": bound.reserve_n}
    return [{"t": 0.0, "kind": "thrust_unloads_a_foot", "leg": bound.leg, **said}]
