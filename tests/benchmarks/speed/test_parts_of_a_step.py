"""Every part of a full step is found where the simulation has it, and timed."""

from __future__ import annotations

import pytest

from testbed.benchmarks.speed import bench
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation


@pytest.mark.slow
def test_every_part_of_a_step_is_timed() -> None:
    world = Simulation(load_scenario("drill_slope_45", duration=2.0))
    try:
        world.run_block(10)
        found = bench._parts(world, 20)
    finally:
        world.close()
    whole = {"engine", "read", "contacts", "hydraulics", "sensors", "estimators", "expected"}
    assert found.keys() == {f"{part}_us" for part in whole}
    assert min(found.values()) > 0.0
    assert found["engine_us"] > found["read_us"]
