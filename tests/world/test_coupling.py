"""The robot on its hydraulics, moving freely: at rest after a shove on any ground and stroke, the
same at finer steps.
"""

from __future__ import annotations

import numpy as np
import pytest

from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation

WEIGHT_N = 4000.0 * 9.81
SHOVE = "events=[{kind: shove, at_s: 0.2, duration_s: 0.05, force_in_world_n: [2000, 1000, -5000]}]"


def _stand(seconds: float, *changes: str) -> np.ndarray:
    """Contact forces (n, 4), N, every ms, of a stand on level ground with shut valves that is
    shoved after 0.2 s.
    """
    overrides = ["terrain.slope_deg=0", "ropes.enabled=false", "hydraulics.valves_locked=true"]
    scenario = load_scenario("stand_slope_45", [*overrides, SHOVE, *changes], duration=seconds)
    simulation = Simulation(scenario)
    try:
        _, truth = simulation.run_block(round(seconds * scenario.rates.record_hz))
        first = simulation.truth_columns.index("contact_normal_fl")
    finally:
        simulation.close()
    return truth[:, first : first + 4]


@pytest.mark.slow
@pytest.mark.parametrize("stroke_m", [0.05, 0.25, 0.45])
@pytest.mark.parametrize("ground_n_m", [4e6, 4e7, 1e9])
def test_a_shoved_robot_comes_to_rest(stroke_m: float, ground_n_m: float) -> None:
    forces = _stand(2.5, f"robot.vertical_m={stroke_m}", f"terrain.stiffness_n_m={ground_n_m:g}")
    shaken, late = np.ptp(forces[200:300], axis=0).max(), np.ptp(forces[-100:], axis=0).max()
    assert shaken > 1500.0
    assert late < 0.01 * shaken
    assert forces[-100:].sum(axis=1).mean() == pytest.approx(WEIGHT_N, rel=1e-3)


@pytest.mark.slow
def test_one_kilohertz_moves_as_four_do() -> None:
    coarse, fine = (_stand(0.6, f"rates.physics_hz={hz}") for hz in (1000, 4000))
    apart = coarse - fine
    shaken = np.ptp(fine[200:300], axis=0).max()
    assert np.sqrt(np.mean(apart**2)) < 0.01 * shaken
