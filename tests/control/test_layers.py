"""Layers hand on what the gait orders; events do what they say."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
from shipped import believed_robot, shipped_robot

from testbed.benchmarks.contact_loss.scenes import Moves
from testbed.control.distribution.controllers import controller, distribution
from testbed.control.gait import Command, Layer, Measured, SetPoints
from testbed.control.gaits.standing import Hold
from testbed.control.layers import LEARN_S, KeepMast, Supervisor, Trim
from testbed.errors import InputError
from testbed.machine.names import RADIAL, ROTATION, VERTICAL
from testbed.robot.model import rotation_from_attitude
from testbed.robot.rope_bearings import SurveyedRopes
from testbed.scenario.events import LiftFoot, SetRope
from testbed.scenario.scenario import load_scenario

STEEP = load_scenario("stand_slope_45", ["terrain.slope_deg=75"])
START = np.tile([0.0, 0.05, 0.25], 4)
LIMITS = np.tile([[-0.4, 0.5], [0.0, 0.4], [0.0, 0.5]], (4, 1))
"""(12, 2) m or rad."""
FEET = shipped_robot().legs.feet(START)


def seen(attitude_rad: np.ndarray) -> Measured:
    return Measured.of(
        position=START, load=8000.0, contact=1.0, rope_tension=15000.0, attitude=attitude_rad
    )


def shared() -> Layer:
    ropes = SurveyedRopes.along(np.array([[29.4, 6.0, 0.0], [29.4, -6.0, 0.0]]))
    return distribution(shipped_robot(), ropes, controller("pseudo_inverse"))


def moves() -> Layer:
    return Moves(SimpleNamespace(time_s=np.array([0.0, 1.0]), moves_m=np.zeros((2, 4))))  # type: ignore[arg-type]


@pytest.mark.parametrize("layer", [Trim, Supervisor, shared, moves, lambda: KeepMast(FEET)])
def test_a_drill_that_is_to_wait_waits_under_every_layer(layer: Callable[[], Layer]) -> None:
    over = layer().over
    waiting = Command(START, hold_drill=True, stance=np.array([True, False, True, True]))
    for t in (0.0, LEARN_S + 1.0):
        out = over(waiting, t, 0.01, seen(np.array([0.0, -1.3, 0.0])))
        assert out.hold_drill and out.stance.tolist() == [True, False, True, True]


def turned(start_rad: np.ndarray, by_rad: np.ndarray) -> np.ndarray:
    """Roll, pitch, yaw of an attitude after a small turn about its own axes."""
    from scipy.spatial.transform import Rotation

    body = rotation_from_attitude(start_rad) @ Rotation.from_rotvec(by_rad).as_matrix()
    return Rotation.from_matrix(body).as_euler("ZYX")[::-1].copy()


def rates(by_rad: np.ndarray) -> np.ndarray:
    """Rates (4) of the vertical joints after two seconds of a body that has turned."""
    mast, start = KeepMast(FEET), np.array([0.0, np.radians(-75.0), 0.0])
    held, set_points = Command(START), SetPoints(START)
    for k in range(300):
        attitude = start if k * 0.01 < LEARN_S else turned(start, by_rad)
        command = mast.over(held, k * 0.01, 0.01, seen(attitude))
        _, rates = set_points.follow(command, 0.01)
    return rates[2::3].copy()


def test_a_turn_about_the_slopes_normal_tilts_no_mast_however_steep_the_slope() -> None:
    assert not rates(
        np.array([0.0, 0.0, 0.0035])
    ).any()  # 0.2 degrees; as a roll angle it is 0.75 on 75 degrees
    about_x = rates(np.array([0.0035, 0.0, 0.0]))
    assert about_x == pytest.approx(-0.4 * 0.0035 * (FEET[:, 1] - FEET[:, 1].mean()), rel=0.02)


def test_a_mast_that_stands_as_it_should_orders_the_same_again() -> None:
    mast, held, commands = KeepMast(FEET), Command(START), []
    for k in range(500):
        tilt = 0.0035 if 100 <= k < 200 else 0.0
        commands.append(mast.over(held, k * 0.01, 0.01, seen(np.array([tilt, 0.0, 0.0]))))
    assert commands[-1] is commands[-2] and commands[50] is held
    moved = [k for k in range(1, 500) if np.any(commands[k].joints != commands[k - 1].joints)]
    assert moved[0] >= 100 and 200 <= moved[-1] < 498
    assert np.any(commands[-1].joints != START)


def test_a_foot_that_is_lifted_twice_carries_in_between_and_not_while_it_is_up() -> None:
    lifts = tuple(LiftFoot(kind="lift_foot", at_s=at, leg="fl") for at in (2.0, 10.0))
    gait, now = Hold(START, None, lifts, LIMITS), Measured.of()
    carries = [bool(gait.command(t, 0.01, now).stance[0]) for t in (1.0, 3.0, 6.0, 11.0, 13.0)]
    assert carries == [True, False, True, False, True]


def test_a_lifted_leg_goes_to_the_ends_of_its_ranges_and_comes_back() -> None:
    lift = LiftFoot(
        kind="lift_foot", at_s=1.0, leg="fr", height_m=0.05, duration_s=12.0, reach_share=0.8
    )
    gait, now = Hold(START, None, (lift,), LIMITS), Measured.of()
    went = np.array([gait.command(t, 0.01, now).joints for t in np.arange(0.0, 14.0, 0.01)])
    fr = slice(3, 6)
    assert np.array_equal(
        np.delete(went, np.r_[fr], axis=1), np.tile(np.delete(START, fr), (1400, 1))
    )
    to_ends = START[:, None] + 0.8 * (LIMITS - START[:, None])
    for joint in (ROTATION[1], RADIAL[1]):
        assert went[:, joint].min() == pytest.approx(to_ends[joint, 0], rel=0.01)
        assert went[:, joint].max() == pytest.approx(to_ends[joint, 1], rel=0.01)
    lowest = went[:, VERTICAL[1]].min()
    assert lowest == pytest.approx(START[VERTICAL[1]] - 1.8 * 0.05, rel=0.01)
    assert went[-1] == pytest.approx(START) and np.abs(np.diff(went, axis=0)).max() < 0.01


@pytest.mark.parametrize("duration_s", [0.004, 0.2, 0.3, 1.0])
@pytest.mark.parametrize("at_s", [0.1, 0.103, 0.29])
def test_a_rope_is_paid_out_by_the_length_that_the_event_says(
    at_s: float, duration_s: float
) -> None:
    event = SetRope(kind="set_rope", at_s=at_s, rope="right", pay_out_m=0.04, duration_s=duration_s)
    gait, now = Hold(START, None, (event,), LIMITS), Measured.of()
    rates = [gait.command(0.01 * k, 0.01, now).rope_rates_m_s for k in range(200)]
    assert 0.01 * np.sum(rates, axis=0) == pytest.approx([0.0, 0.04], rel=1e-9)


@pytest.mark.parametrize(
    "event",
    [
        "{kind: lift_foot, at_s: 2, leg: fl}",
        "{kind: set_rope, at_s: 2, rope: left, pay_out_m: 0.01}",
    ],
)
def test_events_that_a_walking_program_would_not_follow_are_refused(event: str) -> None:
    with pytest.raises(InputError, match="moves what the task crawl moves itself"):
        load_scenario("crawl_slope_30", [f"events=[{event}]"])


def test_a_store_cannot_give_more_rods_than_it_holds() -> None:
    changes = (
        "task={kind: drill, repeat: true, phases: [{kind: rod_change, duration_s: 5, rod_kg: 20}]}"
    )
    with pytest.raises(InputError, match="100 kg are taken off a rod store of 90 kg"):
        load_scenario("stand_slope_45", [changes, "duration_s=30"])
    assert (
        load_scenario("stand_slope_45", [changes, "duration_s=25"]).duration_s == 25
    )  # four laps: 80 kg


def test_what_was_put_on_the_store_may_be_taken_off_again_and_rods_of_the_hole_may_not() -> None:
    put, take = (
        f"{{kind: payload, at_s: {at}, mass_kg: {kg}}}" for at, kg in ((1, 300), (2, -350))
    )
    load_scenario("stand_slope_45", [f"events=[{take}, {put}]"])
    with pytest.raises(InputError, match="350 kg are taken off"):
        load_scenario("stand_slope_45", [f"events=[{take.replace('at_s: 2', 'at_s: 0')}, {put}]"])
    hole = "task={kind: drill_hole, rods: 4, rod_kg: 50, depth_m: 6}"  # three rods leave the store
    for kg, fits in ((80, True), (100, False)):
        change = [hole, f"events=[{{kind: payload, at_s: 1, mass_kg: {-kg}}}]"]
        if fits:
            load_scenario("stand_slope_45", change)
            continue
        with pytest.raises(InputError, match="250 kg are taken off a rod store of 240 kg"):
            load_scenario("stand_slope_45", change)


def test_control_believes_the_rods_in_the_store_that_the_scenario_declares() -> None:
    hole = load_scenario("drill_deep")
    assert hole.carried_kg > 100.0
    empty = believed_robot(load_scenario("stand_slope_45")).model.total_mass_kg
    assert believed_robot(hole).model.total_mass_kg - empty == pytest.approx(hole.carried_kg)
