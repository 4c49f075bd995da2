"""Speed of whole scenarios: every run gives a figure, also one that ends at once."""

from __future__ import annotations

import pytest

from testbed.benchmarks.speed import whole_runs
from testbed.benchmarks.speed.whole_runs import BOUND_EVEN, scenario_speeds, scenario_table


@pytest.mark.slow
def test_a_run_that_ends_early_is_timed_against_the_bare_engine(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The bare engine is said to take 100 us: the ratio is the full step's time over it."""
    monkeypatch.setattr(whole_runs, "_bare_us", lambda bare: 100.0)
    (found,) = scenario_speeds(["slide"])
    assert found["scenario"] == "slide" and found["ground"] == "plane"
    assert found["bound"] == BOUND_EVEN and found["full_step_us"] > 0.0
    assert found["ratio"] == pytest.approx(found["full_step_us"] / 100.0)
    assert scenario_table([found]).rows[0][:2] == ["slide", "plane"]
