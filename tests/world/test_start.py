"""Where a run begins, against what equilibrium on paper gives."""

from __future__ import annotations

import math

import numpy as np
import pytest

from testbed.effects.terms import Hidden
from testbed.machine.names import GRAVITY_M_S2, LEGS
from testbed.recording.rows import DrillKnown
from testbed.robot.robot import Robot
from testbed.scenario.machines import machines_of
from testbed.scenario.scenario import Scenario, load_scenario
from testbed.simulation.live_run import simulate
from testbed.world.engine import Engine
from testbed.world.ground.terrain import make_ground
from testbed.world.start import Start, find_start, nominal_joints


def started(name: str, *changes: str) -> tuple[Scenario, Robot, Start]:
    """The start of a scenario, with the robot that stands there."""
    scenario = load_scenario(name, list(changes))
    machine, ground = machines_of(scenario).truth, make_ground(scenario.terrain)
    robot = Robot.of(machine, scenario.carried_kg, scenario.ropes.attachment_height_m)
    engine = Engine(machine.urdf, ground, step_s=1e-3)
    try:
        known = DrillKnown.zeros()[0]
        start = find_start(scenario, ground, robot.model, engine, machine, known, Hidden())
    finally:
        engine.close()
    return scenario, robot, start


def test_on_level_ground_the_feet_carry_the_weight_and_nothing_pulls() -> None:
    _, robot, start = started("stand_flat")
    weight = robot.model.total_mass_kg * GRAVITY_M_S2
    assert start.foot_forces_in_body.sum(axis=0) == pytest.approx([0.0, 0.0, weight], abs=1e-3)
    assert not start.rope_tension_n.any()
    np.testing.assert_allclose(start.rotation, np.eye(3), atol=1e-12)


def test_each_foot_is_pressed_in_as_deep_as_the_ground_gives_under_its_load() -> None:
    scenario, robot, start = started("stand_flat")
    undersides = start.position_m + robot.model.foot_positions_m(start.joints) @ start.rotation.T
    given_way = start.foot_forces_in_body[:, 2] / make_ground(scenario.terrain).stiffness_n_m
    assert -undersides[:, 2] == pytest.approx(given_way, abs=1e-6)
    moved = start.joints - nominal_joints(scenario)
    assert moved[[0, 1, 3, 4, 6, 7, 9, 10]] == pytest.approx(np.zeros(8), abs=1e-12)


@pytest.mark.parametrize("slope", [30.0, 45.0])
def test_on_a_slope_feet_ropes_and_weight_are_in_balance(slope: float) -> None:
    _, robot, start = started("stand_slope_45", f"terrain.slope_deg={slope}")
    weight = robot.model.total_mass_kg * GRAVITY_M_S2
    ropes = start.rope_tension_n @ (start.rope_directions @ start.rotation)
    along, across = math.sin(math.radians(slope)), math.cos(math.radians(slope))
    left = start.foot_forces_in_body.sum(axis=0) + ropes - weight * np.array([along, 0.0, across])
    assert np.abs(left).max() < 1e-6 * weight


def test_both_ropes_carry_their_share_of_the_weight_along_the_slope() -> None:
    """Half of m g sin 45 by two equal tensions along their directions."""
    _, robot, start = started("stand_slope_45", "ropes.share=0.5")
    along = robot.model.total_mass_kg * GRAVITY_M_S2 * math.sin(math.radians(45.0))
    assert start.rope_tension_n[0] == start.rope_tension_n[1] > 0.0
    ropes = start.rope_tension_n @ (start.rope_directions @ start.rotation)
    assert ropes[0] == pytest.approx(0.5 * along, rel=1e-9)


@pytest.mark.parametrize(
    "ground", [[], ["terrain.kind=heightfield", "terrain.roughness_m=0.05"]], ids=["plane", "rough"]
)
def test_a_robot_held_above_its_ground_falls_as_far_as_it_was_held(ground: list[str]) -> None:
    """Nothing touches before sqrt(2 h / g), whichever leg is the longest; then that one does."""
    held_m = 0.02
    changes = ["robot.vertical_m=[0.2, 0.25, 0.3, 0.22]", f"robot.height_offset_m={held_m}"]
    falls_s = math.sqrt(2.0 * held_m / GRAVITY_M_S2)
    with simulate(load_scenario("stand_flat", [*changes, *ground], duration=0.1)) as run:
        run.step(100)
        loads_n = np.array([np.array(run.truth[f"foot_load_{leg}"]) for leg in LEGS])
        first = int(np.flatnonzero(loads_n.any(axis=0))[0])
        assert run.truth["t"][first] == pytest.approx(falls_s, abs=0.004)
        if not ground:
            assert LEGS[int(loads_n[:, first].argmax())] == "rl"
