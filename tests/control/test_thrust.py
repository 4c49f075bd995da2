"""The thrust that a stance allows: by hand on even ground, held to a share, told where it is
exceeded.
"""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from shipped import MACHINE, shipped_model, slope_gravity

from testbed.control.thrust import (
    ThrustBound,
    ordered_thrust_n,
    thrust_bound,
    thrust_events,
)
from testbed.robot.loads.foot_loads import ExpectedLoads
from testbed.scenario.scenario import Scenario, load_scenario
from testbed.world.assembly import Assembled
from testbed.world.drilling.drilling import Loads, Ordered

STANCE = np.tile([0.0, 0.2, 0.25], 4)


def bound(scenario: Scenario, slope_deg: float) -> ThrustBound:
    slope = math.radians(slope_deg)
    # Ropes along the slope at the centre of mass: they carry all of the pull and turn nothing.
    pull = np.tile([0.5 * 4000.0 * 9.81 * math.sin(slope), 0.0, 0.0], (2, 1))
    model = shipped_model()
    return thrust_bound(scenario, ExpectedLoads(model, MACHINE), STANCE, slope_gravity(slope), pull)


def test_the_reserve_is_less_than_the_load_on_the_slope_and_falls_with_it() -> None:
    scenario = load_scenario("drill_slope_45")
    reserves = [bound(scenario, deg).reserve_n for deg in (0.0, 45.0, 75.0)]
    loads = [4000.0 * 9.81 * math.cos(math.radians(deg)) for deg in (0.0, 45.0, 75.0)]
    assert reserves[0] > reserves[1] > reserves[2] > 0.0
    assert all(0.3 * load < reserve <= load for reserve, load in zip(reserves, loads, strict=True))


def test_the_feed_is_held_to_the_share_asked_for_and_free_without_one() -> None:
    free, held = (
        bound(load_scenario("drill_slope_45", c), 75.0)
        for c in ([], ["control.thrust_reserve=0.4"])
    )
    assert free.most_n == math.inf and free.reserve_n == held.reserve_n
    assert held.most_n == pytest.approx(0.6 * held.reserve_n)


def test_a_task_that_asks_for_more_than_the_reserve_is_told_so() -> None:
    task = load_scenario("drill_slope_45").task
    assert ordered_thrust_n(task) == 5500.0
    assert thrust_events(task, ThrustBound(6000.0, "fl", math.inf)) == []
    (event,) = thrust_events(task, ThrustBound(5000.0, "fl", math.inf))
    assert (event["kind"], event["leg"], event["ordered_n"]) == (
        "thrust_unloads_a_foot",
        "fl",
        5500.0,
    )
    assert ordered_thrust_n(load_scenario("stand_flat").task) == 0.0


@pytest.mark.parametrize("ordered_n", [3000.0, 5000.0, 8000.0, -2000.0])
def test_what_is_recorded_as_ordered_is_what_the_bound_leaves_of_it(ordered_n: float) -> None:
    """Also while the feed wanders about what is ordered."""
    drill = SimpleNamespace(ordered=Ordered(ordered_n), loads=Loads(1.2 * max(ordered_n, 0.0)))
    world = SimpleNamespace(drill=drill, thrust=ThrustBound(10e3, "fl", 5e3), thrust_factor=1.0)
    Assembled.limit_thrust(world)  # type: ignore[arg-type]
    assert drill.ordered.thrust == min(ordered_n, 5e3)
    assert drill.loads.feed == pytest.approx(min(1.2 * max(ordered_n, 0.0), 5e3))
