"""Legs of unequal length on a plane: every foot is on it from the first moment, and the ground
bears the weight.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shipped import MACHINE

from testbed.machine.names import GRAVITY_M_S2, VERTICAL
from testbed.robot.urdf.generate import urdf_text
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation


def test_a_leg_that_is_longer_stands_as_the_others_do(tmp_path: Path) -> None:
    own = tmp_path / "own.urdf"
    own.write_text(urdf_text(MACHINE.replaced({"each_leg.fl.foot_height_retracted_m": -0.26})))
    changes = [f"robot.urdf={own}", "task={kind: stand}", "undeclared=[]"]
    world = Simulation(load_scenario("stand_flat", changes, duration=1.0))
    try:
        world.run_block(1000)
        loads = world.machine.board.normal_force
        joints = world.row["position"][list(VERTICAL)]
        assert joints[0] == pytest.approx(np.mean(joints[1:]) - 0.1, abs=1e-3)
        weight = float(world.machine.engine.masses().sum()) * GRAVITY_M_S2
        assert float(np.sum(loads)) == pytest.approx(weight, rel=0.01)
        assert min(loads) > 0.15 * weight
    finally:
        world.close()
