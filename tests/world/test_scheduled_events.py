"""Events reach the machine when they are due, and only what they name."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from testbed.effects.terms import Hidden
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.machine.names import AXES, SIDES
from testbed.recording.rows import DataRow
from testbed.scenario.events import (
    CutRope,
    FailSensor,
    LiftFoot,
    Payload,
    SetFriction,
    SetSupply,
    Shove,
)
from testbed.world.board import Board
from testbed.world.scheduled_events import ScheduledEvents

TICK_S = 0.01


def machine() -> Any:
    """The board of a machine, and what it is told beside the board."""
    boards = Board.zeros()
    boards["ropes"]["whole"] = 1.0
    told: list[tuple[str, float]] = []
    return SimpleNamespace(
        boards=boards,
        board=boards[0],
        told=told,
        hidden=Hidden(),
        set_friction=lambda friction: told.append(("friction", friction)),
        engine=SimpleNamespace(add_store_mass=lambda kg: told.append(("store", kg))),
    )


def scheduled(*events: Any) -> tuple[Any, Any, ScheduledEvents]:
    m, row = machine(), DataRow.zeros()
    return m, row, ScheduledEvents(m, row, events)


def shove(at_s: float, newton: float, **more: Any) -> Shove:
    return Shove(kind="shove", at_s=at_s, force_in_world_n=(newton, 0.0, 0.0), **more)


def test_events_come_in_the_order_of_their_times_and_each_once() -> None:
    early, late = (SetFriction(kind="set_friction", at_s=t, friction=0.1) for t in (1.0, 2.0))
    *_, pending = scheduled(late, early)
    assert pending.due(0.99, TICK_S) == []
    assert pending.due(2.0 - 1e-12, TICK_S) == [(early, 2.0 - 1e-12), (late, 2.0 - 1e-12)]
    assert pending.due(3.0, TICK_S) == []


def test_a_cut_rope_is_no_rope_that_broke_and_a_rope_that_parts_is_told_once() -> None:
    m, _, world = scheduled()
    world.happen(CutRope(kind="cut_rope", at_s=0.0, rope="left"), 0.0)
    assert m.board.ropes["whole"].tolist() == [0.0, 1.0]
    assert world.broken_ropes() == []
    m.board.ropes[SIDES.index("right")].whole = 0.0
    assert world.broken_ropes() == ["right"]
    assert world.broken_ropes() == []


def test_a_set_pressure_is_told_over_the_atmosphere_and_kept_absolute() -> None:
    m, _, world = scheduled()
    world.happen(SetSupply(kind="set_supply", at_s=0.0, pressure_pa=9e6), 0.0)
    assert m.board.unit.set_pressure == 9e6 + ATMOSPHERE_PA


def test_a_compensator_that_is_set_otherwise_is_so_at_every_set_pressure() -> None:
    """supply.pump: set pressure = pressure_factor (declared)."""
    m, _, world = scheduled()
    m.hidden.pump_pressure_factor = 0.8
    world.happen(SetSupply(kind="set_supply", at_s=0.0, pressure_pa=9e6), 0.0)
    assert m.board.unit.set_pressure == pytest.approx(7.2e6 + ATMOSPHERE_PA)


@pytest.mark.parametrize(("how", "reading_pa"), [("stuck", 3.2e6), ("dead", 0.0)])
def test_a_failed_sensor_shows_what_it_showed_last_or_nothing(how: Any, reading_pa: float) -> None:
    m, row, world = scheduled()
    axis = AXES.index("rl_vertical")
    m.board.transducers["gain"] = 1.0
    row["pressure_b"][0, axis] = 3.2e6
    world.happen(
        FailSensor(kind="fail_sensor", at_s=0.0, at="rl_vertical", chamber="b", how=how), 0.0
    )
    failed = m.board.transducers[1, axis]
    assert failed["gain"] == 0.0 and failed["zero"] == reading_pa
    assert (m.board.transducers["gain"] == 1.0).sum() == 2 * len(AXES) - 1


def pushed(m: Any, world: ScheduledEvents, ticks: range) -> list[tuple[float, float]]:
    """Force on the body and on the last foot, N, in each of these ticks, as a run lets them act."""
    found = []
    for tick in ticks:
        t = tick * TICK_S
        for event, happens_s in world.due(t, TICK_S):
            world.happen(event, happens_s)
        world.push(t, TICK_S)
        found.append((float(m.board.shove[0]), float(m.board.foot_shove[3, 0])))
    return found


def test_pushes_add_up_where_they_act_and_act_in_the_ticks_of_their_time() -> None:
    m, _, world = scheduled(
        shove(0.02, 100.0, duration_s=0.04),
        shove(0.04, 20.0, duration_s=0.04),
        shove(0.04, 7.0, duration_s=0.03, at="rr"),
    )
    assert pushed(m, world, range(10)) == [
        *[(0.0, 0.0)] * 2,
        *[(100.0, 0.0)] * 2,
        *[(120.0, 7.0)] * 2,
        (20.0, 7.0),
        (20.0, 0.0),
        *[(0.0, 0.0)] * 2,
    ]


def test_a_tick_that_a_push_fills_in_part_has_its_mean() -> None:
    """From 23 ms on for 20 ms: seven tenths of the third tick, all of the fourth, three of the
    fifth.
    """
    m, _, world = scheduled(shove(0.023, 100.0, duration_s=0.02))
    found = [body_n for body_n, _ in pushed(m, world, range(7))]
    assert found == pytest.approx([0.0, 0.0, 70.0, 100.0, 30.0, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("duration_s", [1e-4, 0.005, 0.01, 0.025, 0.2, 0.3])
@pytest.mark.parametrize("at_s", [0.1, 0.103, 0.29])
def test_a_push_has_the_momentum_of_its_force_and_duration(at_s: float, duration_s: float) -> None:
    m, _, world = scheduled(shove(at_s, 1000.0, duration_s=duration_s))
    momentum = TICK_S * sum(body_n for body_n, _ in pushed(m, world, range(70)))
    assert momentum == pytest.approx(1000.0 * duration_s, rel=1e-9)


@pytest.mark.parametrize(("step", "body_n"), [(20, 100.0), (23, 100.0), (29, 100.0)])
def test_a_push_that_is_ordered_acts_from_the_next_step_on(step: int, body_n: float) -> None:
    """At 20, 23 and 29 ms, for 20 ms: what was given to the engine for the next step has it, the
    board has it for the rest of the tick, and the last tick has what is left.
    """
    m, _, world = scheduled()
    world.push(0.02, TICK_S)
    m.board.given["force"] = 5.0
    world.order(shove(0.0, 100.0, duration_s=0.02), 1e-3 * step, 1e-3 * (30 - step))
    assert m.board.given["force"].tolist() == [5.0 + body_n, 5.0, 5.0]
    assert float(m.board.shove[0]) == body_n
    left = [n for n, _ in pushed(m, world, range(3, 7))]
    assert left == pytest.approx([100.0, 10.0 * (step - 20), 0.0, 0.0], abs=1e-6)


def test_the_rest_is_handed_on_and_what_a_gait_carries_out_does_nothing_here() -> None:
    m, _, world = scheduled()
    before = m.board.tobytes()
    world.happen(Payload(kind="payload", at_s=0.0, mass_kg=-30.0), 0.0)
    world.happen(SetFriction(kind="set_friction", at_s=0.0, friction=0.3), 0.0)
    world.happen(LiftFoot(kind="lift_foot", at_s=0.0, leg="fl"), 0.0)
    assert m.told == [("store", -30.0), ("friction", 0.3)]
    assert m.board.tobytes() == before
