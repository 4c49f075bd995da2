"""What the pump puts into a whole robot that moves freely is found again: lifted, rubbed,
throttled, stored, moving.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from moving_bodies import link_position, momentum

from testbed.benchmarks.hydraulics.balance import stored
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.machine.names import GRAVITY_M_S2, LEGS
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation

LOST = 1.0e-3
"""Share of the pump's work that may be missing."""
MOTIONS = {
    "raise": (
        "robot.vertical_m=0.15",
        "task={kind: raise, start_s: 0.2, to_m: 0.25, step_m: 0.1, every_s: 5, speed_m_s: 0.05}",
    ),
    "sway": ("task={kind: sway, start_s: 0, amplitude_m: [.05, .05, .05], period_s: [4, 4, 4]}",),
    "sway that drags its feet": (
        "task={kind: sway, start_s: 0, amplitude_m: [.1, .1, .05], period_s: [2, 2, 2]}",
    ),
}
START_MS, MOVE_MS = 100, 4000


def _held_j(simulation: Simulation) -> float:
    """Energy in oil, hoses, height and motion, and what has left: heat, and the air that the rods
    pushed aside.
    """
    board, engine = simulation.machine.board, simulation.machine.engine
    masses = engine.masses()
    heights = [link_position(engine, link)[2] for link in range(-1, len(masses) - 1)]
    lifted = GRAVITY_M_S2 * float(np.dot(masses, heights))
    moving = 0.5 * float(momentum(engine)[0] @ np.array(board.body.velocity))
    rods = zip(board.parameters, board.inputs, strict=True)
    air = sum((own.a.area - own.b.area) * ATMOSPHERE_PA * rod.extension for own, rod in rods)
    oil = stored(board.axes, board.parameters, board.supply, board.unit)
    return lifted + moving + float(air) + oil + float(board.supply.loss)


def _into_the_ground_j(simulation: Simulation, steps: int) -> float:
    """Work of the feet on the ground over so many steps: what sliding rubs off."""
    names = simulation.truth_columns
    columns: Any = [
        [names.index(f"foot_force_in_world_{leg}_{axis}") for axis in "xyz"] for leg in LEGS
    ]
    work, force, feet = 0.0, None, simulation.machine.feet_in_world().copy()
    for _ in range(steps):
        now_n = simulation.run_block(1)[1][0][np.array(columns)]
        now = simulation.machine.feet_in_world().copy()
        mean_n = now_n if force is None else 0.5 * (now_n + force)
        work -= float(np.sum(mean_n * (now - feet)))
        force, feet = now_n, now
    return work


@pytest.mark.slow
@pytest.mark.parametrize("motion", MOTIONS)
def test_the_pump_s_work_is_found_again_in_a_robot_that_moves(motion: str) -> None:
    simulation = Simulation(load_scenario("stand_flat", list(MOTIONS[motion]), duration=20.0))
    try:
        simulation.run_block(START_MS)
        supply = simulation.machine.board.supply
        put_in, held = float(supply.pump_work), _held_j(simulation)
        rubbed = _into_the_ground_j(simulation, MOVE_MS)
        put_in = float(supply.pump_work) - put_in
        found = _held_j(simulation) - held + rubbed
    finally:
        simulation.close()
    assert put_in > 5e3
    assert found == pytest.approx(put_in, rel=LOST)
