"""The environment's speed is counted in simulated time: twenty engine steps for one of its own."""

from __future__ import annotations

import pytest

from testbed.benchmarks.speed.bench import against_bare, resets


@pytest.mark.slow
def test_an_environment_step_costs_no_more_than_twice_the_bare_engines_twenty() -> None:
    found = against_bare(rounds=3, steps=20)
    assert found["ratio"] > 0.5
    assert found["ratio"] == pytest.approx(
        found["env_steps_per_s"] / found["bare_steps_per_s"], rel=0.5
    )


@pytest.mark.slow
def test_the_same_machine_begins_again_in_a_fifth_of_the_time_of_a_new_one() -> None:
    found = resets(draws=2, again=5)
    assert found["same_machine_s"] < 0.2 * found["draw_s"]
