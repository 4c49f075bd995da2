"""What the force-distributing controllers believe of the machine's give, against the machine."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.machine.names import LEGS, VERTICAL
from testbed.robot.loads.foot_loads import OilColumns, internal_force_of
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation

LONGER_M = 3.0e-4
QUIET = [
    "robot.height_offset_m=0.0005",
    "hydraulics.valves_locked=true",
    "hydraulics.without=[friction]",
]


@pytest.mark.parametrize("length_m", [0.15, 0.25, 0.35])
def test_a_longer_leg_squeezes_its_diagonal_as_the_oil_gives_at_its_pressures(
    length_m: float,
) -> None:
    """The oil of a chamber with little pressure is soft with air: three times as soft as at the
    pressures of a loaded machine, by which a squeeze would be let off three times too slowly.
    """
    squeezes_n, gives_m_n = [], []
    for longer_m in (0.0, LONGER_M):
        lengths = [length_m] * (len(LEGS) - 1) + [length_m + longer_m]
        world = Simulation(
            load_scenario("stand_flat", [f"robot.vertical_m={lengths}", *QUIET], duration=1.5)
        )
        try:
            world.run_block(15)
            feet = world.machine.belief.model.foot_positions_m(world.row["position"])
            internal = internal_force_of(feet[:, :2])
            squeezes_n.append(internal @ world.machine.board.normal_force)
            pressures = world.row["pressure_a"], world.row["pressure_b"]
            oil = OilColumns(world.machine.belief.machine)
            give = oil.joint_compliance(world.row["position"], pressures)[list(VERTICAL)].mean()
            gives_m_n.append(give + 1.0 / world.scenario.terrain.stiffness_n_m)
        finally:
            world.close()
    squeezed_n = squeezes_n[1] - squeezes_n[0]
    assert squeezed_n == pytest.approx(internal[-1] * LONGER_M / np.mean(gives_m_n), rel=0.25)
