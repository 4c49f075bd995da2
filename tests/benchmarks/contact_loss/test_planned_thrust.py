"""The thrust that a program orders is known beforehand: what it will be, and for how long it
rises.
"""

from __future__ import annotations

import numpy as np
import pytest

from testbed.benchmarks.contact_loss.warning import planned_thrust
from testbed.scenario.scenario import load_scenario
from testbed.scenario.tasks import Drill, PullOut, Push, Rest
from testbed.world.drilling.drilling import DrillProgram, ramp_share

PHASES = (
    Push(kind="push", duration_s=2.0, feed_n=1000.0),
    Rest(kind="rest", duration_s=0.5),
    PullOut(kind="pull_out", duration_s=1.0, pull_n=400.0),
    Push(kind="push", duration_s=0.6, feed_n=600.0),
)


def test_a_trapezoid_by_hand() -> None:
    """Ramps of half a second from 1 s on: up to 1 kN at 1.5 s, down from 2.5 s to 3 s; 400 N of
    pull at 4 s; then a
    push too short for its ramp: it turns at 4.8 s, at 360 N. The thrust rises from 4 s on, as the
    pull lets go."""
    plan = planned_thrust(Drill(kind="drill", start_s=1.0, ramp_s=0.5, phases=PHASES), 24, 0.25)
    at = {round(0.25 * (n + 1), 2): tuple(row) for n, row in enumerate(plan.tolist())}
    assert at[1.0] == pytest.approx((0.0, 0.5))
    assert at[1.25] == pytest.approx((500.0, 0.25))
    assert at[1.5] == pytest.approx((1000.0, 0.0))
    assert at[2.75] == pytest.approx((500.0, 0.0))
    assert at[4.0] == pytest.approx((-400.0, 0.75))
    assert at[4.25] == pytest.approx((-200.0, 0.5))
    assert at[4.75] == pytest.approx((300.0, 0.0))
    assert at[5.25] == (0.0, 0.0)


@pytest.mark.parametrize("repeat", [False, True])
def test_it_is_what_the_drill_then_orders(repeat: bool) -> None:
    task = Drill(kind="drill", start_s=0.3, ramp_s=0.2, repeat=repeat, phases=PHASES)
    program, plan = DrillProgram(task), planned_thrust(task, 900, 0.01)
    ordered = []
    for n in range(900):
        program.update((n + 1) * 0.01, 0.01)
        ordered.append(program.ordered.thrust)
    edges = (
        np.abs(np.diff(ordered, prepend=0.0)) > 60.0
    )  # where a phase begins, rounding decides whose sample it is
    assert np.abs(plan[:, 0] - ordered)[~edges].max() < 1e-6
    assert (plan[450:, 0] != 0.0).any() == repeat


def test_what_the_rock_decides_is_not_planned() -> None:
    assert not planned_thrust(load_scenario("stand_flat").task, 10, 0.1).any()
    assert ramp_share(0.3, 10.0, 0.0) == 1.0
