"""The programme by which the robot comes to know itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from walking_machine import believed_start, scenario

from testbed.control.gaits.commission import CommissionGait, duration_s, program
from testbed.scenario.scenario import load_scenario
from testbed.scenario.tasks import Commission

UPRIGHT = np.tile([0.0, 0.2, 0.25], 4)


def test_the_programme_lifts_every_foot_by_itself_and_ends_within_ten_minutes() -> None:
    keys = program(Commission(kind="commission"))
    lifted = [np.flatnonzero(~np.array(key.stance)).tolist() for key in keys]
    assert all(len(feet) <= 1 for feet in lifted)
    assert {foot for feet in lifted for foot in feet} == {0, 1, 2, 3}
    for key in keys:
        if all(key.stance):
            assert abs(sum(key.lift_m)) < 1e-12  # feet that carry are askew at most in pairs
    assert np.all(np.diff([key.t for key in keys]) >= 0.0)
    scenario = load_scenario("commissioning_flat")
    assert duration_s(scenario.task) < scenario.duration_s < 600.0


def test_the_ropes_programme_keeps_every_foot_on_the_ground_and_pulls_each_rope_by_itself() -> None:
    keys = program(Commission(kind="commission"), on_ropes=True)
    assert all(all(key.stance) and not any(key.lift_m) for key in keys)
    pulls = {tuple(np.sign(key.pull_m)) for key in keys}
    assert {(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)} <= pulls
    scenario = load_scenario("commissioning_slope")
    assert duration_s(scenario.task, on_ropes=True) < scenario.duration_s
    assert scenario.duration_s + load_scenario("commissioning_flat").duration_s < 600.0


def test_no_cylinder_comes_near_its_stops() -> None:
    """A cylinder at its stop carries what no pressure shows."""
    task = Commission(kind="commission")
    start = believed_start(scenario(), UPRIGHT)
    for on_ropes in (False, True):
        start = replace(start, rope_tension_n=np.full(2, 1e4 if on_ropes else 0.0))
        gait = CommissionGait(task, start)
        times = np.arange(0.0, duration_s(task, on_ropes=on_ropes), 0.5)
        ways = np.array([gait.command(t, 0.1, None).joints for t in times])  # type: ignore[arg-type]
        lower, upper = start.model.limits.T
        share = (ways - lower) / (upper - lower)
        assert np.ptp(share) > 0.1
        assert share.min() > 0.05 and share.max() < 0.95


@pytest.mark.slow
def test_a_foot_is_not_meant_to_carry_as_long_as_it_is_lifted() -> None:
    """From the first centimetre of its way up to the last of its way down."""
    task = Commission(kind="commission")
    start = believed_start(scenario(), UPRIGHT)
    gait = CommissionGait(task, replace(start, rope_tension_n=np.zeros(2)))
    keys, tick = program(task), 0.01
    times = np.arange(0.0, keys[-1].t, tick)
    lift = np.array([np.interp(times + tick, [k.t for k in keys], [k.lift_m[0] for k in keys])])[0]
    carries = np.array([gait.command(t, tick, None).stance[0] for t in times])  # type: ignore[arg-type]
    alone = (times > 0.0) & (times < next(k.t for k in keys if not k.stance[1]))
    assert not carries[alone & (lift > 1e-3)].any()
    assert carries[alone & (lift == 0.0)].mean() > 0.99
