"""Speed of whole scenarios: every run gives a figure, also one that ends at once."""

from __future__ import annotations

from testbed.benchmarks.speed.scenarios import BOUND_EVEN, scenario_speeds


def test_a_run_that_ends_early_is_timed_against_the_bare_engine() -> None:
    (found,) = scenario_speeds(["slide"])
    assert (
        found["scenario"] == "slide" and found["ground"] == "plane" and found["bound"] == BOUND_EVEN
    )
    assert 5.0 < found["full_step_us"] < 5000.0
    assert 0.1 < found["ratio"] < 10.0
