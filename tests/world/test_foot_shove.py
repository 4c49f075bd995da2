"""Somebody pushes a foot: the ground answers force and moment, and the leg feels it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from testbed.machine.names import LEGS
from testbed.recording.rows import TruthRow
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation

FORCE = np.array([600.0, -400.0, 1500.0])


def _ground(*changes: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force of the ground on each foot (4, 3), mean over the last 0.1 s of 1 s, N; where the feet
    are (4, 3), m, and the place of the body (3).
    """
    world = Simulation(load_scenario("stand_flat", list(changes), duration=1.0))
    try:
        truth = TruthRow.from_table(world.run_block(1000)[1])
        joints = np.array(world.machine.board["engine"]["joint"])
        feet = world.machine.belief.legs.feet(joints)
        last = truth["foot_force_in_world"][-100:].mean(axis=0)
        return last, feet, truth["foot_load"][-100:].mean(axis=0)
    finally:
        world.close()


@pytest.mark.slow
@pytest.mark.parametrize("leg", ["fl", "rr"])
def test_the_ground_answers_a_pushed_foot_by_force_and_moment(leg: str) -> None:
    event = (
        f"{{kind: shove, at_s: 0.3, duration_s: 1, at: {leg}, force_in_world_n: {FORCE.tolist()}}}"
    )
    still, feet, _ = _ground()
    pushed, _, _ = _ground(f"events=[{event}]")
    answer = pushed - still
    np.testing.assert_allclose(answer.sum(axis=0), -FORCE, atol=15.0)
    moment = np.cross(feet, answer).sum(axis=0) + np.cross(feet[LEGS.index(leg)], FORCE)
    np.testing.assert_allclose(moment, 0.0, atol=40.0)
    up = answer[:, 2]
    assert np.argmin(up) == LEGS.index(leg), "the pushed foot itself gives up most of it"
    assert up[LEGS.index(leg)] < -0.5 * FORCE[2]


@pytest.mark.slow
@pytest.mark.parametrize("at", ["body", "rl"])
def test_a_push_that_is_ordered_is_that_of_a_scenario_at_that_time(at: str) -> None:
    """Both act from 50 to 70 ms; additions in another order differ in their last bits."""
    push = {"kind": "shove", "at": at, "duration_s": 0.02, "force_in_world_n": [0.0, 0.0, -900.0]}
    told = load_scenario("stand_flat", [f"events=[{json.dumps({**push, 'at_s': 0.05})}]"])
    loads = []
    for scenario in (told, load_scenario("stand_flat")):
        world = Simulation(scenario)
        try:
            _, first = world.run_steps(50)
            if scenario is not told:
                world.happen(told.events[0])
            loads.append(np.concatenate([first, world.run_steps(50)[1]]))
            assert world.events[-1]["t"] == 0.05
        finally:
            world.close()
    by_event, by_order = (TruthRow.from_table(rows)["foot_load"] for rows in loads)
    assert np.abs(by_event[60] - by_event[49]).sum() > 100.0
    assert np.abs(by_order - by_event).max() < 1e-3
