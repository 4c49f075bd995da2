"""Feet felt through linkages: what cylinders of a mixed machine tell of its feet is what statics
and virtual work have it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mixed import mixed_folder, mixed_machine

from testbed.control.distribution.statics import FEET, Statics
from testbed.control.gait import Measured
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.body_belief import body_of
from testbed.estimation.live.chain import EstimatorChain
from testbed.machine.model import Machine
from testbed.machine.names import LEGS
from testbed.recording.rows import DataRow, TruthRow
from testbed.robot.loads.foot_loads import ExpectedLoads
from testbed.robot.model import RobotModel, attitude_gravity
from testbed.robot.rope_bearings import NO_ROPES
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation
from testbed.world.summary import world_summary

STANCE = np.array([0.1, 0.2, 0.25, 0.05, 0.15, 0.22, -0.1, 0.2, 0.3, 0.0, 0.25, 0.2])
LEVEL = attitude_gravity(0.0, 0.0)
STEP = 1.0e-6


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    return mixed_machine(tmp_path_factory.mktemp("mixed"))


def rod_lengths(q: np.ndarray) -> np.ndarray:
    """Distances of the pins of the mixed machine by Pythagoras, up to constants; (12) m."""
    out = np.empty(12)
    for k, leg in enumerate(LEGS):
        turn, slide, lift = q[3 * k : 3 * k + 3]
        out[3 * k] = 0.18 * turn
        out[3 * k + 1] = 0.5 * slide if leg == "rl" else slide
        out[3 * k + 2] = lift if leg == "rr" else math.hypot(0.5 + lift, 0.4)
    return out


def rod_forces(model: RobotModel, feet: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Cylinder forces (12) that hold the feet's loads (4, 3) by virtual work: what each rod does
    over a small step of its joint is what weight and feet do over it.
    """
    out = np.empty(12)
    weights = model.gravity_forces(q, LEVEL)[6:]
    for i in range(12):
        way = np.zeros(12)
        way[i] = STEP
        moved = model.foot_positions_m(q + way) - model.foot_positions_m(q - way)
        rod = rod_lengths(q + way) - rod_lengths(q - way)
        out[i] = (2.0 * STEP * weights[i] - (moved * feet).sum()) / rod[i]
    return out


def still(machine: Machine) -> tuple[RobotModel, np.ndarray, np.ndarray]:
    """Model, forces of the ground (4, 3) and a row of data (1,) of the mixed machine standing
    still, no friction in its cylinders.
    """
    model = RobotModel(machine.urdf)
    loads = ExpectedLoads(model, machine).solve(STANCE, LEVEL, joint_compliance=np.zeros(12))
    force, row = rod_forces(model, loads.force_in_body_n, STANCE), DataRow.zeros()
    for i, axis in enumerate(machine.axes.values()):
        bore, rod = axis.cylinder.bore_m, axis.cylinder.rod_m
        row["pressure_b"][0, i] = 2.0e6
        pushed = force[i] + 2.0e6 * math.pi / 4 * (bore**2 - rod**2)
        row["pressure_a"][0, i] = pushed / (math.pi / 4 * bore**2)
    row["position"], row["specific_force"] = STANCE, -LEVEL
    row["oil_temperature"], row["supply_pressure"], row["carrying"] = 40.0, 9.0e6, 1.0
    return model, loads.force_in_body_n, row


def test_statics_weigh_feet_by_virtual_work(machine: Machine) -> None:
    model, feet, row = still(machine)
    statics = Statics(model, machine, NO_ROPES)
    now = statics.balance(
        Measured.of(
            position=STANCE,
            pressure_a=row["pressure_a"][0],
            pressure_b=row["pressure_b"][0],
            load=feet[:, 2],
            attitude=np.zeros(3),
            supply_pressure=9.0e6,
        ),
        np.ones(4, dtype=bool),
    )
    found = now.measured[:FEET].reshape(4, 3)
    np.testing.assert_allclose(found[:, 1:], feet[:, :2], atol=1.0)
    bore = np.array([axis.cylinder.bore_m for axis in machine.axes.values()])
    arms = (rod_lengths(STANCE + STEP) - rod_lengths(STANCE - STEP)) / (2.0 * STEP)
    gauge = 9.0e6 - machine.power_unit.tank_pressure_pa
    np.testing.assert_allclose(now.highest, gauge * math.pi / 4 * bore**2 * arms, rtol=1e-6)


def test_the_papers_and_the_own_estimates_read_a_still_machine(machine: Machine) -> None:
    model, feet, row = still(machine)
    belief = Believed.from_machine(machine, 1e-3)
    body = body_of(machine, model, belief.legs, 1e-3, NO_ROPES)
    chain = EstimatorChain(replace(belief, body=body))
    for _ in range(3000):
        chain.step(row)
    estimate, held = row["estimate"][0], [machine.each_leg[leg].sliding_mass_kg for leg in LEGS]
    weighed = estimate["two_chamber"] + 9.81 * np.array(held)
    np.testing.assert_allclose(weighed, feet[:, 2], atol=1.0)
    np.testing.assert_allclose(estimate["own"], feet[:, 2], atol=150.0)
    np.testing.assert_allclose(row["own"][0]["x"], feet[:, 0], atol=150.0)
    np.testing.assert_allclose(row["own"][0]["y"], feet[:, 1], atol=150.0)


def _errors(folder: Path | None, task: str, seconds: float) -> tuple[str, np.ndarray, float]:
    """Verdict, rms error of the own estimate of each foot (4), N, and way of the body, m."""
    changes = [f"task={task}", "robot.rotation_deg=[5, -5, -5, 5]", "robot.radial_m=0.17"]
    changes += [f"machine.folder={folder}"] if folder else ["machine.set=inferred"]
    world = Simulation(load_scenario("stand_flat", changes, duration=seconds))
    try:
        wrong = []
        while not world.finished:
            data, truth = world.run_block(1000)
            own = DataRow.from_table(data)["estimate"]["own"]
            wrong.append(own - TruthRow.from_table(truth)["foot_load"])
        late = np.concatenate(wrong)[1000:]
        return world.verdict, np.sqrt((late**2).mean(axis=0)), world_summary(world)["body_travel_m"]
    finally:
        world.close()


@pytest.mark.slow
def test_a_mixed_machine_stands_and_feels_its_feet_as_a_straight_one(tmp_path: Path) -> None:
    straight = _errors(None, "{kind: stand}", 5.0)
    mixed = _errors(mixed_folder(tmp_path), "{kind: stand}", 5.0)
    assert mixed[0] == straight[0] == "stood"
    assert mixed[1].max() < max(1.5 * straight[1].max(), 150.0)


@pytest.mark.long
def test_a_mixed_machine_crawls_and_feels_its_feet_as_a_straight_one(tmp_path: Path) -> None:
    crawl = "{kind: crawl, start_s: 1, steps: 4, step_length_m: 0.3, swing_height_m: 0.05}"
    straight = _errors(None, crawl, 24.0)
    mixed = _errors(mixed_folder(tmp_path), crawl, 24.0)
    assert mixed[0] == straight[0] == "stood"
    assert mixed[2] > 0.9 * straight[2]
    assert mixed[1].max() < 1.5 * straight[1].max()
