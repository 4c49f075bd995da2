"""A foot's way through the air, and what the walk does when ground or reach are not as planned."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from shipped import MACHINE
from walking_machine import LEGS, LOADS, START, TICK, at_the_start, crawl, step

from testbed.control.gaits.crawl.pace import FREE_SHARE, SWING_RAMP, Pace
from testbed.control.gaits.crawl.swing import CLEAR, Activity, Swing

ARMS = np.tile([0.19, 1.0, 1.0], 4)
PACE = Pace(MACHINE, ARMS)


def swing(forward: float, up: float, above: float = 0.0, ramp: float = SWING_RAMP) -> Swing:
    """Leg fl from its place at the start, `forward` ahead and `above` higher, by a top `up` above
    the start; `ramp`: share of each part's time in which its speed rises, and falls.
    """
    foot = LEGS.feet(START)[0]
    end = foot + np.array([forward, 0.0, above])
    top_m, still = float(foot[2]) + up, np.zeros(3)
    return Swing(LEGS, 0, foot, end, still, still, top_m, ramp=ramp).timed(PACE)


def test_a_swing_leads_from_its_start_over_its_top_to_its_end() -> None:
    way = swing(0.3, 0.16, above=0.11)
    places = np.array([way.foot(t, np.zeros(3)) for t in np.linspace(0.0, way.duration_s, 301)])
    np.testing.assert_allclose(places[0], way.start, atol=1e-12)
    np.testing.assert_allclose(places[-1], way.end, atol=1e-12)
    assert places[:, 2].max() == pytest.approx(way.start[2] + 0.16, abs=1e-9)
    high = np.flatnonzero(places[:, 2] > way.start[2] + 0.12)
    np.testing.assert_allclose(places[: high[0] // 3, 0], way.start[0], atol=0.005)


def test_a_foot_that_goes_over_sooner_gains_that_share_of_rise_and_descent_and_is_clear() -> None:
    """Half of the usual share: at a foot's first centimetre ahead it is still 4 mm up at least."""
    usual = swing(0.4, 0.06, above=0.01)
    sooner = replace(usual, clear=0.5 * CLEAR)
    gained = 0.5 * CLEAR * (usual.rise_s + usual.lower_s)
    assert usual.duration_s - sooner.duration_s == pytest.approx(gained)
    times = np.linspace(0.0, sooner.duration_s, 1001)
    places = np.array([sooner.foot(t, np.zeros(3)) for t in times])
    ahead = places[np.argmax(places[:, 0] > sooner.start[0] + 0.01)]
    assert ahead[2] > sooner.start[2] + 0.004


def test_rise_and_descent_take_what_the_vertical_valve_needs() -> None:
    """0.16 m of 70 mm bore at 95 % of 25 L/min, with ramps; straight up and down nothing else takes
    time.
    """
    way = swing(0.0, 0.16, above=0.11)
    metre_s = math.pi / 4 * 0.07**2 / (FREE_SHARE * 4.1667e-4) / (1.0 - SWING_RAMP)
    assert way.rise_s == pytest.approx(0.16 * metre_s, rel=1e-3)
    assert way.lower_s == pytest.approx(0.05 * metre_s, rel=1e-3)
    assert way.over_s == 0.0 and way.duration_s == pytest.approx(0.21 * metre_s, rel=1e-3)


@pytest.mark.parametrize("ramp", [SWING_RAMP, 0.14])
def test_no_joint_of_a_swing_is_faster_than_its_valve(ramp: float) -> None:
    way = swing(0.4, 0.06, above=0.01, ramp=ramp)
    times = np.linspace(0.0, way.duration_s, 2001)
    feet = np.array([way.foot(t, np.zeros(3)) for t in times])
    joints = np.array([LEGS.joints(np.tile(foot, (4, 1)))[:3] for foot in feet])
    speed = np.abs(np.diff(joints, axis=0)).max(axis=0) / (times[1] - times[0])
    bore = math.pi / 4 * np.array([0.063, 0.063, 0.07]) ** 2 * np.array([0.19, 1.0, 1.0])
    allowed = FREE_SHARE * np.array([2.6667e-4, 2.6667e-4, 4.1667e-4]) / bore
    assert np.all(speed < 1.001 * allowed) and np.max(speed / allowed) > 0.99


def test_shorter_ramps_save_time_in_proportion() -> None:
    """A mean speed of 0.86 instead of 0.8 of the valve's."""
    usual, sooner = swing(0.4, 0.06, above=0.01), swing(0.4, 0.06, above=0.01, ramp=0.14)
    assert sooner.duration_s / usual.duration_s == pytest.approx((1.0 - SWING_RAMP) / 0.86)


def test_a_foot_that_took_a_jerk_for_the_ground_searches_on() -> None:
    """A load of 4 kN for one tick at the search's beginning; the ground is 30 mm below."""
    made, seen, t = crawl("task.steps=1"), at_the_start(), 0.0
    ground, jerked, touched, searches = made._feet[3, 2] - 0.03, False, False, 0
    before = None
    while made.steps_done < 1 and t < 20.0:
        doing = made._phase.doing if made._phase is not None else before
        searches += doing is Activity.SEARCH and before is not Activity.SEARCH
        loads, before = LOADS.copy(), doing
        if doing is Activity.SEARCH:
            touched = made._feet[3, 2] <= ground
            loads[3], jerked = (4000.0 if touched or not jerked else 0.0), True
        elif doing is not Activity.SHIFT and not touched:
            loads[3] = 0.0
        seen, _, _ = step(made, seen, t, loads)
        t += TICK
    assert made.steps_done == 1 and searches == 2
    assert made._feet[3, 2] == pytest.approx(ground, abs=2e-3)


def test_a_walk_whose_foot_stands_too_far_back_falls_behind_its_plan_and_goes_on() -> None:
    made, planned = (crawl("task.gait=two_phase", "task.steps=40") for _ in range(2))
    made._feet[0, 0] -= 0.2  # a foot of the second group: the others carry the body away from it
    free, goal = (
        walk._plan.next_phases(walk._feet, walk._body, 0)[0].way for walk in (planned, made)
    )
    assert free is not None and goal is not None
    assert made._plan._behind_m == pytest.approx(0.1) and planned._plan._behind_m == 0.0
    assert goal.end[0] == pytest.approx(free.end[0] - made._plan._behind_m)
    assert made._footholds.reaches(made._feet, goal.end)
