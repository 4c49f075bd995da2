"""The crawl's plan and its pieces, without a world: ranges, paces, ropes, touch and internal."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from shipped import MACHINE, shipped_model
from walking_machine import (
    ANCHORS,
    LEGS,
    START,
    TENSION,
    TICK,
    at_the_start,
    believed_start,
    crawl,
    scenario,
    step,
)

from testbed.control.gaits.crawl.footholds import Footholds, Swings
from testbed.control.gaits.crawl.gait import CrawlGait
from testbed.control.gaits.crawl.pace import (
    LOADED_SHARE,
    PEAK,
    RAMP,
    TRACTION_SHARE,
    Pace,
    margin_share,
    progress,
)
from testbed.control.gaits.crawl.rope_hold import THREE_FEET, RopeHold
from testbed.control.gaits.crawl.style import STYLES, UNHURRIED
from testbed.control.gaits.crawl.swing import Activity
from testbed.control.gaits.crawl.walk_plan import Stride
from testbed.control.gaits.table import gait_of
from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.robot.loads.foot_loads import internal_force_of

ARMS = np.tile([0.19, 1.0, 1.0], 4)
"""Of levers about the middle of their range."""


def walk(made: CrawlGait, until_s: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Set points and stance of a machine that follows perfectly and whose feet never meet ground
    early.
    """
    seen, out = at_the_start(), []
    for k in range(round(until_s / TICK)):
        seen, joints, stance = step(made, seen, k * TICK)
        out.append((joints, stance))
    return out


@pytest.mark.parametrize("gait", ["flowing", "brisk", "two_phase", "wave"])
def test_a_walk_stays_within_ranges_and_speeds_and_swings_one_leg_at_a_time(gait: str) -> None:
    made = crawl(f"task.gait={gait}", "task.step_length_m=0.3", "task.steps=4")
    rows = walk(made, 45.0)
    joints = np.array([row[0] for row in rows])
    low, high = shipped_model().limits.T
    assert made.done and made.steps_done == 4
    assert np.all(joints > low) and np.all(joints < high)
    assert max(int((~row[1]).sum()) for row in rows) == 1
    speed = np.abs(np.diff(joints, axis=0)).max(axis=0) / TICK
    rated_m_s = 0.0856  # a radial valve's rated flow on its bore
    assert speed.reshape(4, 3)[:, 1].max() < rated_m_s * made._plan.manner.haste
    assert made.way_m == pytest.approx(0.2 if gait == "wave" else 0.225, abs=0.07)
    assert min(made.margins_n) > 1000.0


def test_a_stride_out_of_reach_is_refused_before_anything_moves() -> None:
    with pytest.raises(InputError, match=r"task\.step_length_m.*out of its range"):
        spec = scenario("task.step_length_m=0.4")
        gait_of(spec, believed_start(spec, np.tile([0.0, 0.38, 0.25], 4)))


def test_the_body_flows_on_while_legs_swing_and_rests_in_the_two_phase_gait() -> None:
    moved = {}
    for gait in ("flowing", "two_phase"):
        made = crawl(f"task.gait={gait}", "task.step_length_m=0.3")
        seen, moved[gait] = at_the_start(), 0.0
        for k in range(3000):
            before = made.way_m
            seen, _, stance = step(made, seen, k * TICK)
            moved[gait] += 0.0 if stance.all() else made.way_m - before
    assert moved["two_phase"] == 0.0 and moved["flowing"] > 0.1


@pytest.mark.slow
def test_the_brisk_gait_makes_the_same_way_in_less_time_with_less_margin() -> None:
    """Eight swings and the way back over the feet on winches, which take no time of their own: a
    quarter less time at least; six tenths of the margin are enough on 45 degrees.
    """
    took, margins = {}, {}
    for gait in ("flowing", "brisk"):
        changes = f"task.gait={gait}", "task.steps=8", "ropes.strokes=false"
        made, seen, tick = crawl(*changes), at_the_start(), 0
        while not made.done:
            seen, _, _ = step(made, seen, tick * TICK)
            tick += 1
        took[gait], margins[gait] = tick * TICK, min(made.margins_n)
        assert made.steps_done == 8 and made.way_m == pytest.approx(0.7, abs=0.02)
    assert took["brisk"] < 0.75 * took["flowing"]
    assert 0.55 * margins["flowing"] < margins["brisk"] < 0.8 * margins["flowing"]


@pytest.mark.parametrize(
    ("slope_deg", "hurries", "enough"), [(30, True, 0.6), (85, True, 0.3), (90, False, 1.0)]
)
def test_the_brisk_gait_hurries_on_every_slope_but_on_a_wall(
    slope_deg: float, hurries: bool, enough: float
) -> None:
    made, slope = crawl("task.gait=brisk"), math.radians(slope_deg)
    made._footholds.stand_under(9.81 * np.array([-math.sin(slope), 0.0, -math.cos(slope)]))
    assert made._plan.manner == (STYLES["brisk"] if hurries else UNHURRIED)
    assert made._plan.creep == (0.75 if hurries else 0.0)
    assert made._plan.enough == pytest.approx(enough)


@pytest.mark.parametrize(("slope_deg", "share"), [(30, 0.6), (45, 0.6), (60, 0.4), (75, 0.0)])
def test_the_steeper_the_slope_the_less_the_body_moves_on_three_feet(
    slope_deg: float, share: float
) -> None:
    made, slope = crawl("task.gait=flowing"), math.radians(slope_deg)
    made._footholds.stand_under(9.81 * np.array([-math.sin(slope), 0.0, -math.cos(slope)]))
    assert made._plan.creep == pytest.approx(share, abs=1e-3)


def test_a_swing_waits_for_a_leg_that_lags() -> None:
    made, seen, t = crawl(), at_the_start(), 0.0
    while made._phase is None or made._phase.doing is not Activity.SWING or made._clock < 0.5:
        seen, _, _ = step(made, seen, t)
        t += TICK
    clock, stuck = made._clock, seen.position.copy()
    stuck[3 * made._phase.leg] += 0.1
    made.command(t, TICK, seen.but(position=stuck))
    assert made._clock == clock
    made.command(t, TICK, seen)
    assert made._clock == pytest.approx(clock + TICK)


def test_a_valve_against_the_highest_load_has_the_supplys_margin_alone() -> None:
    """15 of 35 bar at an edge of 0.75 of the rating that fills a ring of 1 - (36 / 63)^2."""
    share = margin_share(MACHINE.power_unit, MACHINE.axes["fl_rotation"])
    assert share == pytest.approx(0.75 / (1.0 - (36 / 63) ** 2) * math.sqrt(15 / 35))
    constant = build_machine({"power_unit.supply_kind": 0})
    assert margin_share(constant.power_unit, constant.axes["fl_rotation"]) == 1.0


def test_on_three_feet_the_body_waits_for_smaller_differences_of_tension() -> None:
    ropes = RopeHold(ANCHORS, shipped_model().rope_attachments_m, TENSION)
    wanted = ropes.wanted_n(np.zeros(3))
    unequal = wanted * np.array([0.93, 1.07])
    assert ropes.readiness(np.zeros(3), unequal) == 1.0
    assert 0.0 < ropes.readiness(np.zeros(3), unequal, THREE_FEET) < 1.0
    assert ropes.readiness(np.zeros(3), wanted * np.array([0.89, 1.0]), THREE_FEET) == 0.0


def test_sideways_is_a_heading_like_any_other() -> None:
    made = crawl("task.heading_deg=90", "task.step_length_m=0.2", "task.steps=4")
    walk(made, 40.0)
    assert made.done
    assert made._body[1] == pytest.approx(made.way_m) and made.way_m > 0.1
    assert abs(made._body[0]) < 0.05


def test_a_shift_takes_as_long_as_its_slowest_valve() -> None:
    """One radial joint over 0.1 m: 0.1 m of 63 mm bore at 70 % of 16 L/min, with ramps."""
    pace = Pace(MACHINE, ARMS)
    joints = np.tile(START, (11, 1))
    joints[:, 1] += np.linspace(0.0, 0.1, 11)
    volume = 0.1 * math.pi / 4 * 0.063**2
    needed = PEAK * volume / (LOADED_SHARE * 2.6667e-4)
    assert pace.shift_s(joints, np.zeros((11, 2))) == pytest.approx(needed, rel=1e-3)
    ropes = np.linspace([30.0, 30.0], [29.9, 29.9], 11)
    assert pace.shift_s(np.tile(START, (11, 1)), ropes) == pytest.approx(
        PEAK * 0.1 / (TRACTION_SHARE * 0.06), rel=1e-3
    )


def test_haste_asks_for_more_of_the_valves_and_for_no_more_than_a_traction_device_has() -> None:
    pace, joints = Pace(MACHINE, ARMS), np.tile(START, (11, 1))
    joints[:, 1] += np.linspace(0.0, 0.1, 11)
    still, ropes = np.zeros((11, 2)), np.linspace([30.0, 30.0], [29.9, 29.9], 11)
    usual = pace.shift_s(joints, still), pace.shift_s(np.tile(START, (11, 1)), ropes)
    pace.haste = 1.35
    assert pace.shift_s(joints, still) == pytest.approx(usual[0] / 1.35)
    assert pace.shift_s(np.tile(START, (11, 1)), ropes) == pytest.approx(usual[1] * TRACTION_SHARE)


def test_a_stride_that_was_chosen_holds_from_the_next_group_on_and_one_out_of_reach_is_not_made() -> (
    None
):
    """Groups of two swings of 0.4 m take the body's plan 0.2 m on, those of 0.2 m 0.1 m; 2 m is out
    of reach.
    """
    made = crawl("task.steps=8")
    plan = made._plan
    plan.choose(Stride(0.2, 0.05), 2)
    assert [plan._way_m(k) for k in (2, 4, 6)] == pytest.approx([0.2, 0.3, 0.4])
    made = crawl("task.steps=8")
    made.choose(Stride(2.0, 0.05), 1.0)
    assert made._next_group() and made._plan.stride == Stride(0.4, 0.05)


def test_progress_is_a_trapezoid_of_speed() -> None:
    shares = np.linspace(0.0, 1.0, 2001)
    way = np.array([progress(float(s)) for s in shares])
    assert way[0] == 0.0 and way[-1] == pytest.approx(1.0)
    assert np.max(np.diff(way) / np.diff(shares)) == pytest.approx(PEAK, rel=1e-6)
    assert progress(RAMP) == pytest.approx(0.5 * RAMP * PEAK)


def test_ropes_keep_the_pull_along_the_slope_wherever_the_body_goes() -> None:
    ropes = RopeHold(ANCHORS, shipped_model().rope_attachments_m, TENSION)
    pull = (TENSION @ ropes.directions(np.zeros(3)))[:2]
    for body in (np.array([10.0, 0.0, 0.0]), np.array([3.0, 1.5, 0.0])):
        np.testing.assert_allclose(
            (ropes.wanted_n(body) @ ropes.directions(body))[:2], pull, rtol=1e-9, atol=1e-6
        )
    before = np.array([-0.05, 0.0, 0.0])
    assert np.all(ropes.rates_m_s(np.zeros(3), before, 1.0, TENSION) < -0.045)
    assert (
        ropes.readiness(np.zeros(3), 0.5 * TENSION) == 0.0
        and ropes.readiness(np.zeros(3), TENSION) == 1.0
    )
    slack = RopeHold(ANCHORS, shipped_model().rope_attachments_m, np.zeros(2))
    assert not slack.rates_m_s(np.zeros(3), before, 1.0, np.zeros(2)).any()


def test_ropes_whose_pull_a_program_shares_out_are_hauled_with_the_body_alone() -> None:
    """Ropes that pull otherwise than they did, but as much together, keep nobody waiting; a body on
    a tenth less than it had waits for a sixth of its speed.
    """
    still, before = np.zeros(3), np.array([-0.01, 0.0, 0.0])
    own = RopeHold(ANCHORS, shipped_model().rope_attachments_m, TENSION)
    shared = replace(own, shared=True)
    along = own.directions(still)[:, :2] @ own.pull_n / np.hypot(*own.pull_n)
    other = TENSION + 0.3 * TENSION.mean() * np.array([1.0 / along[0], -1.0 / along[1]])
    assert own.readiness(still, other) == 0.0 and shared.readiness(still, other) == 1.0
    slack_share, taut_share = 0.80, 0.92
    wanted = (0.9 - slack_share) / (taut_share - slack_share)
    assert shared.readiness(still, 0.9 * TENSION) == pytest.approx(wanted)
    assert shared.readiness(still, 0.5 * TENSION) == shared.readiness(still, 1.5 * TENSION) == 0.0
    assert (
        own.rates_m_s(still, before, 1.0, other)[0] > own.rates_m_s(still, before, 1.0, TENSION)[0]
    )
    np.testing.assert_allclose(
        shared.rates_m_s(still, before, 1.0, other),
        own.rates_m_s(still, before, 1.0, TENSION),
        rtol=1e-12,
    )


def test_ropes_turn_the_body_by_what_they_pull_more_until_its_load_lies_in_the_middle() -> None:
    """4 kN of load, 60 mm down the slope and 30 mm aside, ropes 0.7 m above the feet: 343 and
    171 N. What asks for more than a twenty-fifth of the pull is made up for in part.
    """
    attachments = shipped_model().rope_attachments_m
    ropes, nowhere = RopeHold(ANCHORS, attachments, TENSION), np.zeros(3)
    feet = np.zeros((4, 3))
    feet[:, 2] = attachments[:, 2].mean() - 0.7
    offset = np.array([-0.06, 0.03])
    trimmed, back = ropes.trimmed(offset, feet, 4000.0)
    more = (trimmed.tension_n @ trimmed.directions(nowhere))[:2] - ropes.pull_n
    np.testing.assert_allclose(more, -offset * 4000.0 / 0.7, rtol=1e-9)
    np.testing.assert_allclose(back, offset, rtol=1e-12)
    much, part = ropes.trimmed(100.0 * offset, feet, 4000.0)
    most = 0.04 * np.hypot(*ropes.pull_n)
    assert np.hypot(*(much.pull_n - ropes.pull_n)) == pytest.approx(most)
    assert np.ptp(part / offset) == pytest.approx(0.0, abs=1e-9) and part[0] > 100.0 * offset[0]


@pytest.mark.parametrize(("lightness", "share"), [(0.7, 0.0), (0.5, 0.0), (0.375, 0.5), (0.1, 1.0)])
def test_the_lighter_the_feet_the_more_the_ropes_make_up_for_and_the_less_margin_is_asked_for(
    lightness: float, share: float
) -> None:
    brisk, flowing = STYLES["brisk"], STYLES["flowing"]
    assert brisk.trimmed(lightness) == pytest.approx(share) and flowing.trimmed(lightness) == 0.0
    assert brisk.enough(lightness) == pytest.approx(0.6 - 0.3 * share)
    assert flowing.enough(lightness) == 1.0


def test_the_diagonal_has_no_resultant_on_staggered_feet() -> None:
    feet = np.array([[1.4, 1.0], [1.2, -1.0], [-1.0, 1.0], [-1.2, -1.0]])
    internal = internal_force_of(feet)
    np.testing.assert_allclose([internal.sum(), *(internal @ feet)], 0.0, atol=1e-12)
    assert internal[0] > 0.0 and np.linalg.norm(internal) == pytest.approx(1.0)


def test_the_body_shifts_away_from_the_swinging_legs_until_the_margin_is_enough() -> None:
    model = shipped_model()
    footholds = Footholds(model, LEGS, START, 0.65)
    footholds.stand_under(
        9.81 * np.array([-math.sin(math.radians(45)), 0.0, -math.cos(math.radians(45))])
    )
    ropes = RopeHold(ANCHORS, model.rope_attachments_m, TENSION)
    args = (footholds.home, np.zeros(3), [0, 1, 2], TENSION, ropes.directions(np.zeros(3)))
    middle = footholds.margin_n(*args)
    goal, margin = footholds.body_goal(
        np.zeros(3),
        Swings(
            np.array([0.0, 1.0, 0.0]),
            footholds.home,
            [(3, footholds.home[3])],
            np.zeros(3),
            np.zeros(3),
            *args[3:],
        ),
    )
    assert goal[1] > 0.05 and margin > middle + 1000.0
