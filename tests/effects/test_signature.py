"""What a change of the robot's measurements is made of: points, ways, lines between knots."""

from __future__ import annotations

from dataclasses import fields
from types import SimpleNamespace

import numpy as np
import pytest

from testbed.diagnosis.robot.unexplained import (
    UnexplainedFlow,
    UnexplainedForce,
    UnexplainedWrench,
    is_unexplained,
    listed,
)
from testbed.effects.signature import KNOT_S, Change, RobotSeen, at_point, knots
from testbed.machine.names import AXES

TIME_S = np.linspace(0.1, 9.9, 50)


def test_the_wrench_of_a_force_at_a_point_is_the_force_and_its_moment() -> None:
    up, ahead = np.array([[0.0, 0.0, 1_000.0]]), np.array([2.0, 0.0, 0.0])
    assert at_point(up, ahead) == pytest.approx(np.array([[0, 0, 1_000, 0, -2_000, 0]]))
    assert at_point(up, np.zeros(3))[0, 3:] == pytest.approx(0.0)


def test_points_may_differ_from_bin_to_bin() -> None:
    force = np.tile([0.0, 100.0, 0.0], (3, 1))
    points = np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 5.0, 0.0]])
    assert at_point(force, points)[:, 5] == pytest.approx([100.0, 200.0, 0.0])


def test_any_straight_course_that_begins_at_nothing_is_made_of_the_knots() -> None:
    tents = knots(TIME_S)
    assert tents.min() >= 0.0 and tents.max() <= 1.0
    course = 3.0 * TIME_S
    weights = 3.0 * KNOT_S * np.arange(1, tents.shape[1] + 1)
    assert tents @ weights == pytest.approx(course)


def test_tents_and_the_first_knot_share_all_time_out() -> None:
    assert knots(TIME_S)[TIME_S >= KNOT_S].sum(axis=1) == pytest.approx(1.0)


def test_so_many_units_change_everything_by_as_much() -> None:
    rng = np.random.default_rng(5)
    one = Change(
        force={3: rng.normal(size=4)},
        wrench=rng.normal(size=(4, 6)),
        oil={7: rng.normal(size=(4, 2))},
        balance=rng.normal(size=(4, 18)),
        line={2: rng.normal(size=2)},
        feet=rng.normal(size=(4, 4, 3)),
        supply=rng.normal(size=4),
        unit_turned=rng.normal(size=3),
    )
    three = one.times(3.0)
    for field in fields(Change):
        before, after = getattr(one, field.name), getattr(three, field.name)
        if isinstance(before, dict):
            assert {key: pytest.approx(3.0 * part) for key, part in before.items()} == after
        else:
            assert after == pytest.approx(3.0 * before)


def test_what_a_change_leaves_alone_stays_alone() -> None:
    none = Change().times(5.0)
    assert (none.force, none.oil, none.line) == ({}, {}, {})
    assert none.wrench is none.balance is none.feet is none.supply is None


def seen(bins: int = 50) -> RobotSeen:
    """Measurements of which only times and directions are asked for."""
    direction = np.ones((bins, len(AXES)))
    direction[1::2] = -1.0
    given = SimpleNamespace(time_s=TIME_S[:bins], bins=bins, direction=direction)
    given.axis = lambda place: AXES.index(place)
    return given  # type: ignore[return-value]


def test_an_unexplained_force_has_any_course_and_one_against_the_motion() -> None:
    signature = UnexplainedForce().signature(seen(), "fl_vertical")
    columns = np.column_stack(
        [change.force[AXES.index("fl_vertical")] for change in signature.values()]
    )
    half = columns.shape[1] // 2
    assert columns[0::2, :half] == pytest.approx(columns[0::2, half:])
    assert columns[1::2, :half] == pytest.approx(-columns[1::2, half:])
    assert np.linalg.matrix_rank(columns) == columns.shape[1]
    assert all(set(change.force) == {AXES.index("fl_vertical")} for change in signature.values())


def test_an_unexplained_wrench_has_each_component_by_itself() -> None:
    signature = UnexplainedWrench().signature(seen(), "body")
    for name, change in signature.items():
        component = int(name.split()[0])
        assert change.wrench is not None
        assert not np.delete(change.wrench, component, axis=1).any()
        assert change.wrench[:, component].any()


def test_an_unexplained_flow_has_each_chamber_by_itself() -> None:
    signature = UnexplainedFlow().signature(seen(), "rr_radial")
    for name, change in signature.items():
        flow = change.oil[AXES.index("rr_radial")]
        assert not flow[:, 1 - int(name.split()[0])].any() and flow.any()


def test_a_set_with_what_has_no_name_is_not_listed() -> None:
    assert listed(("sensor.gain_a@fl_vertical",)) and listed(())
    assert not listed(("sensor.gain_a@fl_vertical", "unnamed.force@fr_radial"))
    assert is_unexplained("unnamed.flow@fl_radial") and not is_unexplained("rope.direction")
