"""A swaying body: feet stay, ropes follow, and the way is the sinusoid that was asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from walking_machine import LEGS, believed_start, scenario

from testbed.control.gait import Measured
from testbed.control.gaits.standing import RISE_S, SwayGait
from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.machine.folder import machine_folder
from testbed.robot.robot import Robot
from testbed.scenario.tasks import Sway

START = np.tile([0.0, 0.2, 0.25], 4)
TICK = 0.01
UNSEEN = Measured.of()
BEGIN = replace(
    believed_start(scenario(), START), rope_directions_in_body=np.tile([1.0, 0.0, 0.0], (2, 1))
)


def test_feet_stay_where_they_are_while_the_body_moves_and_each_rope_is_hauled_by_what_the_body_climbs() -> (
    None
):
    gait, hauled = SwayGait(Sway(kind="sway"), BEGIN), np.zeros(2)
    for k in range(900):
        command = gait.command(k * TICK, TICK, UNSEEN)
        hauled += command.rope_rates_m_s * TICK
        moved = LEGS.feet(command.joints) + gait.body_m((k + 1) * TICK) - LEGS.feet(START)
        assert np.abs(moved).max() < 1e-9
    np.testing.assert_allclose(hauled, -gait.body_m(9.0)[0], atol=1e-9)
    assert np.ptp(command.joints - START) > 0.01


def test_a_quarter_period_after_the_start_the_body_stands_at_its_amplitude() -> None:
    task = Sway(kind="sway", start_s=0.0, amplitude_m=(0.0, 0.0, 0.05), period_s=(20.0, 20.0, 20.0))
    gait = SwayGait(task, BEGIN)
    assert RISE_S < 5.0
    np.testing.assert_allclose(gait.body_m(5.0), [0.0, 0.0, 0.05], atol=1e-12)
    np.testing.assert_allclose(gait.body_m(0.0), 0.0)
    assert np.all(np.diff([gait.body_m(t)[2] for t in np.arange(0.0, 5.0, 0.1)]) >= 0.0)


def test_a_way_that_no_cylinder_reaches_is_refused_with_the_share_that_fits() -> None:
    wide = Sway(kind="sway", amplitude_m=(0.0, 0.0, 0.1), start_s=0.0)
    with pytest.raises(InputError, match=r"vertical beyond its range.*0\.5 times that") as refused:
        SwayGait(wide, replace(BEGIN, joints=np.tile([0.0, 0.2, 0.45], 4)))
    assert refused.value.field == "task.amplitude_m"


def test_a_way_that_nobody_asked_for_goes_with_the_machine() -> None:
    scale = BEGIN.robot.machine.scale
    assert scale.length == 1.0
    whole = SwayGait(Sway(kind="sway"), BEGIN).body_m(12.0)
    asked = SwayGait(Sway(kind="sway", amplitude_m=(0.06, 0.05, 0.05)), BEGIN).body_m(12.0)
    np.testing.assert_array_equal(whole, asked)
    small = Robot.of(build_machine(folder=machine_folder("quarter_model")))
    start = replace(BEGIN, robot=small, joints=np.tile([0.0, 0.05, 0.0625], 4))
    swayed = SwayGait(Sway(kind="sway"), start).body_m(12.0)
    np.testing.assert_allclose(swayed, small.machine.scale.length * whole)
