"""Footprints tell where the ground is met, by numbers worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from walking_machine import TICK, at_the_start, crawl, step

from testbed.control.gaits.crawl.known_ground import KnownGround
from testbed.control.gaits.crawl.swing import Activity, Phase

AHEAD = np.array([1.0, 0.0, 0.0])
STEPS_M, STRIDE_M = 0.1, 0.4


@pytest.fixture
def known() -> KnownGround:
    """Rock with two footprints, 0.4 m apart on the left track."""
    ground = KnownGround(STEPS_M)
    ground.stood(np.array([2.0, 1.0, -0.35]))
    ground.stood(np.array([1.6, 1.0, -0.45]))
    return ground


def test_ground_where_nobody_stood_may_lie_higher_by_all_of_its_steps(known: KnownGround) -> None:
    for place in ([1.7, -1.0, -0.4], [2.5, 1.0, -0.4], [1.1, 1.0, -0.4]):
        found = known.expected(np.array(place), AHEAD, STRIDE_M)
        assert (found.height_m, found.steps_m) == (-0.4, STEPS_M)


def test_between_footprints_it_lies_between_them_and_is_the_surer_the_nearer(
    known: KnownGround,
) -> None:
    on = known.expected(np.array([1.6, 1.0, 0.0]), AHEAD, STRIDE_M)
    assert (on.height_m, on.steps_m) == (-0.45, 0.0)
    between = known.expected(np.array([1.7, 1.0, 0.0]), AHEAD, STRIDE_M)
    assert between.height_m == pytest.approx(-0.425)
    assert between.steps_m == pytest.approx(STEPS_M * 0.1 / 0.4)
    beside = known.expected(np.array([1.64, 1.03, 0.0]), AHEAD, STRIDE_M)
    assert beside.height_m == pytest.approx(-0.44)
    assert beside.steps_m == pytest.approx(STEPS_M * 0.05 / 0.4), "3 and 4 make 5"


def test_on_a_plane_footprints_change_nothing() -> None:
    plane = KnownGround(0.0)
    plane.stood(np.array([1.6, 1.0, -0.45]))
    place = np.array([1.62, 1.0, -0.4])
    found = plane.expected(place, AHEAD, STRIDE_M)
    assert (found.height_m, found.steps_m) == (-0.4, 0.0)


def test_a_way_to_the_left_has_tracks_of_its_own(known: KnownGround) -> None:
    left = known.expected(np.array([1.6, 0.9, 0.0]), np.array([0.0, 1.0, 0.0]), STRIDE_M)
    assert left.height_m == -0.45
    assert left.steps_m == pytest.approx(STEPS_M * 0.1 / 0.4)


ROUGH = "task.ground_steps_m=0.1", "task.step_length_m=0.3"


@pytest.mark.parametrize(("gait", "remembers"), [("brisk", True), ("flowing", False)])
def test_a_walk_remembers_where_feet_have_carried(gait: str, remembers: bool) -> None:
    made, seen = crawl(f"task.gait={gait}", *ROUGH, "task.steps=2"), at_the_start()
    for k in range(round(30.0 / TICK)):
        seen = step(made, seen, k * TICK)[0]
    assert made.steps_done == 2
    again = made._plan.known.expected(made._feet[3], AHEAD, 0.3)
    assert again.steps_m == pytest.approx(0.0 if remembers else 0.1, abs=2e-3)


def test_a_foot_rises_over_and_seeks_known_ground_as_on_a_plane() -> None:
    def next_swing(rise_m: float | None) -> Phase:
        made = crawl("task.gait=brisk", *ROUGH)
        made.command(0.0, TICK, at_the_start())
        feet, body = made._feet.copy(), np.zeros(3)
        swing = made._plan.next_phases(feet, body, 0)[2]
        assert swing.doing is Activity.SWING and swing.swing is not None
        if rise_m is None:
            return swing
        made._plan.known.stood(swing.swing.end * [1, 1, 0] + [0, 0, feet[swing.leg, 2] + rise_m])
        return made._plan.next_phases(feet, body, 0)[2]

    unknown, known = next_swing(None).swing, next_swing(0.02).swing
    assert unknown is not None and known is not None
    start_m, lift_m = unknown.start[2], 0.05
    assert unknown.high_m - start_m == pytest.approx(0.11), "over all that the ground may rise by"
    assert unknown.end[2] - start_m == pytest.approx(0.01 + 0.3 * 0.1), "higher ground is rare"
    assert known.high_m - start_m == pytest.approx(0.03 + lift_m)
    assert known.end[2] - start_m == pytest.approx(0.03), "10 mm above what is expected"
    assert known.duration_s < unknown.duration_s - 0.1
