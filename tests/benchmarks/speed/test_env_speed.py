"""The environment's speed is counted in simulated time: twenty engine steps for one of its own."""

from __future__ import annotations

import pytest

from testbed.benchmarks.speed.environments import against_bare


@pytest.mark.slow
def test_an_environment_step_costs_no_more_than_twice_the_bare_engines_twenty() -> None:
    found = against_bare(rounds=3, steps=20)
    assert found["ratio"] > 0.5
    assert found["ratio"] == pytest.approx(
        found["env_steps_per_s"] / found["bare_steps_per_s"], rel=0.5
    )
