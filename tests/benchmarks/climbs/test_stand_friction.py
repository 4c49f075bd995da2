"""Friction in use by the feet of quiet stands."""

from __future__ import annotations

from testbed.benchmarks.climbs.stand_friction import AIM, StandFriction


def test_no_feet_together_use_more_than_the_one_that_uses_most() -> None:
    found = StandFriction(machines=1, duration_s=3.0).work(1)
    assert 0.0 < found["together_end"] <= found["worst_foot_end"] <= found["worst_foot_peak"] < 1.0
    assert found["together_end"] <= found["together_peak"] <= found["worst_foot_peak"]


def test_machines_below_the_aim_are_counted_and_shares_are_lowest_median_highest() -> None:
    stands = StandFriction(machines=3)
    answers = {
        name: {"worst_foot_peak": share}
        for name, share in zip(stands.cases(), (AIM - 0.1, AIM, AIM + 0.2), strict=True)
    }
    told = stands.summarise(answers)
    assert told["below_aim"] == 2
    assert told["shares"]["worst_foot_peak"] == [AIM - 0.1, AIM, AIM + 0.2]
