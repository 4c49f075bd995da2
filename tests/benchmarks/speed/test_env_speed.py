"""The environment's speed is counted in simulated time: twenty engine steps for one of its own."""

from __future__ import annotations

import pytest

from testbed.benchmarks.speed.bench import against_bare, resets
from testbed.benchmarks.speed.workers import worker_speeds, workers_table
from testbed.errors import InputError


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


@pytest.mark.slow
def test_two_workers_are_timed_beside_one() -> None:
    """How many times as fast depends on what else the machine does: no more than two."""
    found = worker_speeds([2], rounds=1, seconds=0.4)
    assert [row[:2] for row in workers_table(found).rows] == [
        [step, workers] for step in ("20", "50") for workers in ("1", "2")
    ]
    for one, two in (found[:2], found[2:]):
        assert (one["workers"], one["times_one"], one["share"]) == (1, 1.0, 1.0)
        assert two["share"] == pytest.approx(two["times_one"] / 2)
        assert 0.3 < two["times_one"] < 3.0


def test_less_than_one_worker_is_refused() -> None:
    with pytest.raises(InputError, match="1 or more"):
        worker_speeds([0])
