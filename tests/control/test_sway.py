"""A swaying body: feet stay, ropes follow, and the way is the sinusoid that was asked for."""

from __future__ import annotations

import numpy as np
from shipped import shipped_robot

from testbed.control.programs.references import Measured
from testbed.control.programs.sway import RISE_S, SwayProgram
from testbed.machine.build import build_machine
from testbed.robot.kinematics import LegKinematics
from testbed.scenario.tasks import Sway

START = np.tile([0.0, 0.2, 0.25], 4)
ROPES = np.tile([1.0, 0.0, 0.0], (2, 1))
TICK = 0.01
UNSEEN = Measured(START, np.zeros(4), np.ones(4), np.zeros(2), np.zeros(3))


def test_feet_stay_where_they_are_while_the_body_moves_and_each_rope_is_hauled_by_what_the_body_climbs() -> (
    None
):
    program = SwayProgram(Sway(kind="sway"), shipped_robot().legs, START, ROPES)
    legs, hauled = LegKinematics.from_machine(build_machine()), np.zeros(2)
    for k in range(900):
        command = program.update(k * TICK, TICK, UNSEEN)
        command.reference += command.rate * TICK
        hauled += command.rope_rate_m_s * TICK
        moved = legs.feet(command.reference) + program.body_m((k + 1) * TICK) - legs.feet(START)
        assert np.abs(moved).max() < 1e-9
    np.testing.assert_allclose(hauled, -program.body_m(9.0)[0], atol=1e-9)
    assert np.ptp(command.reference - START) > 0.01


def test_a_quarter_period_after_the_start_the_body_stands_at_its_amplitude() -> None:
    task = Sway(kind="sway", start_s=0.0, amplitude_m=(0.0, 0.0, 0.05), period_s=(20.0, 20.0, 20.0))
    program = SwayProgram(task, shipped_robot().legs, START, ROPES)
    assert RISE_S < 5.0
    np.testing.assert_allclose(program.body_m(5.0), [0.0, 0.0, 0.05], atol=1e-12)
    np.testing.assert_allclose(program.body_m(0.0), 0.0)
    assert np.all(np.diff([program.body_m(t)[2] for t in np.arange(0.0, 5.0, 0.1)]) >= 0.0)
