"""What a person is told at the end of a run: which numbers, in which words."""

from __future__ import annotations

from typing import Any

import pytest

from testbed.report.console import summary_rows

LEAST: dict[str, Any] = {"verdict": "stood", "wall_s": None, "simulated_s": 2.0}


def told(**more: Any) -> dict[str, str]:
    return dict(summary_rows(LEAST | more))


def test_a_summary_of_little_is_told_in_two_rows() -> None:
    assert told() == {"verdict": "stood", "simulated": "2.0 s"}
    assert told(wall_s=0.5)["simulated"] == "2.0 s in 0.5 s"
    assert told(interrupted=True)["verdict"] == "stood (interrupted)"


def test_the_worst_leg_stands_for_expected_loads_and_unknown_legs_do_not_count() -> None:
    row = "expected load error, worst leg"
    assert told(expected_rms_n={"fl": 120.0, "fr": None, "rl": 1234.5})[row] == "1 234 N"
    assert row not in told(expected_rms_n={"fl": None})


@pytest.mark.parametrize(("error_n", "way"), [(310.0, "short of"), (-310.0, "above")])
def test_a_leg_that_stands_out_is_named_with_its_side(error_n: float, way: str) -> None:
    named = {"stands_out": {"leg": "rr", "error_n": error_n}}
    assert told(residuals=named)["stands out"] == f"rr, 310 N {way} the expected load"
    assert "stands out" not in told(residuals=None)


def test_losses_delays_and_wrong_seconds_are_the_detectors() -> None:
    detector = {"losses": 3, "missed": 1, "false_alarms": 1, "delay_median_s": 0.0124}
    rows = told(
        detector=detector | {"missed_s": 0.5, "false_flight_s": 0.25}, contact_losses_not_meant=2
    )
    assert rows["contact losses"] == "3 (2 not meant)"
    assert rows["detector"] == "1 missed, 1 false alarm, wrong for 0.75 leg-seconds"
    assert rows["detector's delay, median"] == "12 ms"
    never = told(detector=detector | {"delay_median_s": None}, contact_losses_not_meant=0)
    assert "detector's delay, median" not in never


@pytest.mark.parametrize(("surprise", "times"), [(4.0, "2.0"), (9.0, "3.0")])
def test_a_machine_that_is_not_as_believed_is_told(surprise: float, times: str) -> None:
    row = told(surprise=surprise)["the machine"]
    assert row == f"seems {times} times as far from its belief as its stated uncertainty"
    assert told(surprise=1.9) == told()


def test_slips_of_a_millimetre_and_more_are_told() -> None:
    rows = told(foot_slip_m=0.3021, rope_slip_m=0.0647)
    assert rows["feet slid"] == "302 mm"
    assert rows["rope that ran through its clamps"] == "65 mm"
    assert told(foot_slip_m=0.0004, rope_slip_m=0.0) == told()


def test_a_task_says_what_is_left_of_it() -> None:
    walk = {"done": False, "steps_made": 3, "steps_wanted": 8}
    assert told(task="crawl", progress=walk)["task"] == "crawl: unfinished, 3 of 8 steps"
    assert told(task="stand", progress={"done": True})["task"] == "stand: done"
    chain = walk | {"parts_done": 1, "parts_wanted": 3}
    assert told(task="chain", progress=chain)["task"] == (
        "chain: unfinished, 1 of 3 parts, 3 of 8 steps"
    )


def test_a_machine_without_ropes_is_told_no_tension() -> None:
    moved = {"lowest_stability_margin": 0.4, "tilt_max_deg": 0.0, "climbed_m": 0.0}
    name = "rope tension, highest"
    assert (
        told(**moved, rope_tension_max_n={"left": 9.0, "right": 0.0})[name] == "left 9 N, right 0 N"
    )
    assert name not in told(**moved, rope_tension_max_n={"left": 0.0, "right": 0.0})
