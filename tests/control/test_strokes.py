"""What the brisk gait reckons of its ropes' traction devices, and what it makes of that."""

from __future__ import annotations

import numpy as np
import pytest
from walking_machine import ANCHORS, TENSION, TICK, at_the_start, crawl, step

from testbed.control.gaits.crawl.gait import EASE_S
from testbed.control.gaits.crawl.rope_hold import RopeHold
from testbed.control.gaits.crawl.strokes import END_M, STEPS, WORN_SHARE, Strokes
from testbed.control.gaits.crawl.walk_plan import PAYING_CREEP
from testbed.laws.traction import GRIPPED, IDLE_S, RESERVE_M, TractionState, traction_step
from testbed.machine.build import build_machine
from testbed.robot.traction import traction_parameters

MACHINE = build_machine()
SUPPLY_PA = 9.0e6
WHOLE_M = MACHINE.traction.stroke_m - RESERVE_M


def strokes(*, winches: bool = False) -> Strokes:
    device = traction_parameters(MACHINE, strokes=not winches)
    return Strokes(device, MACHINE.rope.stiffness_ea_n)


def haul(made: Strokes, *rates_m_s: float, until_s: float) -> None:
    for _ in range(round(until_s / TICK)):
        made.follow(np.array(rates_m_s), TENSION, SUPPLY_PA, TICK)


def test_a_device_is_reckoned_as_its_law_has_it() -> None:
    made, rates = strokes(), 0.05 * np.sin(np.arange(2000) / 300.0)[:, None] - [0.03, 0.02]
    truth, device = TractionState.zeros(2), traction_parameters(MACHINE, strokes=True)
    truth["way"], truth["place"] = -1.0, RESERVE_M
    for told in rates:
        made.follow(told, TENSION, SUPPLY_PA, TICK)
        for side, rate in enumerate(told):
            for _ in range(STEPS):
                traction_step(truth[side], device, rate, TENSION[side], SUPPLY_PA, TICK / STEPS)
        assert made.gripped == bool((truth["mode"] == GRIPPED).all())
        np.testing.assert_array_equal(made.owed_m, truth["owed"])
    assert truth["regrips"].min() >= 2.0


def test_a_body_that_rests_lets_both_devices_go_back_together() -> None:
    """Left hauls 50 and right 40 mm/s. The rest is the time to be idle, two clamps and the longer
    way back at 0.15 m/s; one after the other they would take nearly twice as long.
    """
    made, ready, resting_s, slipped_m = strokes(), [], 0.0, 0.0
    while not ready or resting_s == 0.0 or ready[-1] == 0.0:
        ready.append(made.readiness())
        resting_s += TICK * (1.0 - ready[-1])
        slipped_m = max(slipped_m, float(np.abs(made.owed_m).max()))
        haul(made, -0.05 * ready[-1], -0.04 * ready[-1], until_s=TICK)
    assert set(ready) == {0.0, 1.0}
    back_s = (WHOLE_M - END_M) / MACHINE.traction.return_speed_m_s
    assert resting_s == pytest.approx(IDLE_S + 2 * MACHINE.traction.clamp_s + back_s, abs=0.05)
    assert slipped_m < 2e-3, "nothing was asked for that no device could do"
    assert made.left_m == pytest.approx([WHOLE_M, WHOLE_M], abs=2e-3)


def test_a_body_does_not_rest_at_an_end_that_no_device_leaves() -> None:
    """Paid out over a whole stroke, then hauled back: a device at rest keeps such a stroke, so the
    body goes on to the end of it.
    """
    made = strokes()
    haul(made, 0.05, 0.05, until_s=2.5)
    assert made.left_m.min() > 0.1 and not made.goes_back.any()
    while made.gripped:
        assert made.readiness() == 1.0
        haul(made, -0.05, -0.05, until_s=TICK)
    assert made.readiness() == 0.0


def test_a_body_does_not_rest_for_a_worn_device_because_the_other_one_would_go_back() -> None:
    """The left one has paid out before and hauls to its end; the right one has half its stroke."""
    made = strokes()
    haul(made, 0.05, 0.0, until_s=2.5)
    while made.left_m[0] > 0.5 * END_M:
        haul(made, -0.05, -0.02, until_s=TICK)
    assert list(made.goes_back) == [False, True]
    assert made.gripped and made.readiness() == 1.0


def test_a_stroke_is_given_up_where_it_is_worn_and_does_not_last() -> None:
    made = strokes()
    made.renew(2.0 * WHOLE_M)
    assert made.readiness() == 1.0, "a new one would not last either"
    haul(made, -0.05, -0.05, until_s=0.5 * WHOLE_M / 0.05)
    assert 0.5 < WORN_SHARE < 1.0
    made.renew(0.45 * WHOLE_M)
    assert made.readiness() == 1.0
    made.renew(0.55 * WHOLE_M)
    assert made.readiness() == 0.0
    haul(made, 0.0, 0.0, until_s=3.0)
    assert made.readiness() == 1.0 and made.left_m.min() > 0.95 * WHOLE_M


def test_a_winch_has_no_strokes() -> None:
    made = strokes(winches=True)
    haul(made, -0.05, 0.05, until_s=20.0)
    assert made.readiness() == 1.0 and np.isinf(made.left_m).all()


def test_rope_that_a_device_owes_is_not_asked_for_again() -> None:
    ropes = RopeHold(ANCHORS, np.zeros((2, 3)), TENSION)
    here, low = np.zeros(3), ropes.wanted_n(np.zeros(3)) - 500.0
    assert (ropes.rates_m_s(here, here, TICK, low) < 0.0).all()
    owed = ropes.rates_m_s(here, here, TICK, low, np.full(2, 500.0))
    assert owed == pytest.approx([0.0, 0.0], abs=1e-12)


def test_the_brisk_gaits_body_never_starts_or_stops_at_once() -> None:
    """From its greatest speed it takes half of EASE_S at least to come to rest."""
    made, seen = crawl("task.gait=brisk", "task.steps=8"), at_the_start()
    places = [made.moved_m]
    for tick in range(3000):
        seen, _, _ = step(made, seen, tick * TICK)
        places.append(made.moved_m)
    speeds = np.diff(places, axis=0) / TICK
    fastest = float(np.linalg.norm(speeds, axis=1).max())
    changes = np.linalg.norm(np.diff(speeds, axis=0), axis=1) / TICK
    assert made.steps_done >= 6 and fastest > 0.06
    assert changes.max() < fastest / (0.5 * EASE_S)


def test_where_a_shift_pays_out_more_than_a_device_can_shifts_make_more_of_the_way() -> None:
    """A shift of 0.25 m aside pays 41 mm of the other rope out, its device has 30. The walk stays
    so: a body that changes its mind from sway to sway slips.
    """
    plan, here = crawl("task.gait=brisk")._plan, np.zeros(3)
    aside, onward = np.array([0.0, -0.25, 0.0]), np.array([0.1, 0.0, 0.0])
    usual = plan.creep
    assert usual > 0.0
    creeps = []
    for goal in (onward, 0.5 * aside, aside, onward):
        plan._spare_the_ropes(here, goal)
        creeps.append(plan.creep)
    spared = PAYING_CREEP * usual
    assert creeps == pytest.approx([usual, usual, spared, spared])


def test_winches_pay_out_as_far_as_one_likes() -> None:
    np.testing.assert_array_equal(strokes(winches=True).reserve_m, [np.inf, np.inf])
    np.testing.assert_array_equal(strokes().reserve_m, [RESERVE_M, RESERVE_M])
