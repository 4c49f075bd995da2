"""A cylinder at the end of its stroke is held by the hydraulics' stop alone, which the foot forces
know of.
"""

from __future__ import annotations

import numpy as np

from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation


def test_a_leg_driven_against_its_end_stop_pushes_on_the_stop_and_not_on_its_foot() -> None:
    world = Simulation(
        load_scenario("stand_flat", ["robot.radial_m=0.398", "machine.set=original"], duration=2.0)
    )
    try:
        board, engine = world.machine.board, world.machine.engine
        world.run_block(300)
        board.loops[1].reference = 0.45  # beyond the stroke of 0.4 m
        world.run_block(300)
        assert 0.4 < board.engine.joint[1] < 0.402
        contact = np.zeros((4, 3))
        engine.feet.forces(contact, np.zeros(4))
        assert np.abs(board.foot_force[0] - contact[0]).max() < 5.0
        assert np.linalg.norm(contact[0, :2]) < 0.7 * contact[0, 2]
    finally:
        world.close()
