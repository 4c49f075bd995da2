"""Forces and moments on the robot add up to the change of its momentum, on every ground, slope and
loading order.
"""

from __future__ import annotations

import numpy as np
import pytest
from moving_bodies import link_position, momentum

from testbed.machine.names import GRAVITY_M_S2
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation

BOUND = 0.001
"""Share of the weight."""


GROUNDS = {
    "plane": ["terrain.kind=plane"],
    "box": ["terrain.kind=box"],
    "heightfield": ["terrain.kind=heightfield", "terrain.roughness_m=0.05"],
    "step": ["terrain.kind=profile", "terrain.profile_m=[[0.1, 0], [0.1, 0.12]]"],
    "bench": [
        "terrain.kind=profile",
        "terrain.profile_m=[[-1.5, 0], [-0.7, -0.1], [-0.5, 0], [0.6, 0], [1.5, 0.1]]",
    ],
    "patches": [
        "terrain.patches=[{foot: fl, stiffness_n_m: 2.0e6}, {foot: rr, friction: 0.1, stiffness_n_m: 1.0e7}]"
    ],
    "loose": ["terrain.plastic_n_m=1.0e6", "terrain.stiffness_n_m=2.0e7"],
    "loose_rock": [
        "terrain.kind=heightfield",
        "terrain.roughness_m=0.03",
        "terrain.plastic_n_m=1.0e6",
        "terrain.stiffness_n_m=2.0e7",
    ],
    "elevation": ["terrain.kind=elevation", "terrain.elevation={file: ELEVATION, frame: slope}"],
}


@pytest.fixture(scope="module", autouse=True)
def elevation(tmp_path_factory: pytest.TempPathFactory) -> None:
    """A ramp of waves, 8 m wide, to stand on."""
    path = tmp_path_factory.mktemp("ground") / "waves.npy"
    x = np.arange(-4.0, 4.05, 0.1)
    np.save(path, 0.04 * np.sin(1.7 * x)[:, None] + 0.03 * np.cos(2.3 * x)[None, :])
    GROUNDS["elevation"] = [o.replace("ELEVATION", str(path)) for o in GROUNDS["elevation"]]


def residuals(
    kind: str, order: str, slope: float, steps: int = 40
) -> tuple[np.ndarray, np.ndarray]:
    """Largest residual of force (share of the weight) and of moment (weight x 1 m) over single
    steps while drilling.
    """
    overrides = [*GROUNDS[kind], f"terrain.loading_order={order}", f"terrain.slope_deg={slope}"]
    overrides += ["task.start_s=0.05", "rates.record_hz=1000"]
    world = Simulation(load_scenario("drill_slope_45", overrides, duration=1.0))
    engine, board = world.machine.engine, world.machine.board
    masses = engine.masses()
    weight = float(masses.sum()) * GRAVITY_M_S2
    force_error, moment_error = np.zeros(3), np.zeros(3)
    try:
        world.run_block(400)
        for _ in range(steps):
            before, turning_before = momentum(engine)
            given, torque = board.given.force.copy(), board.given.torque.copy()
            at = board.body.position.copy()
            centre = np.average(
                [link_position(engine, i) for i in range(-1, len(masses) - 1)],
                axis=0,
                weights=masses,
            )
            world.run_block(1)
            after, turning_after = momentum(engine)
            force = board.foot_force.sum(axis=0) + given + [0.0, 0.0, -weight]
            moment = np.cross(at, given) + torque + np.cross(centre, [0.0, 0.0, -weight])
            for row in engine.bullet.getContactPoints():
                sign = 1.0 if row[1] == engine.robot else -1.0
                contact = (
                    row[9] * np.array(row[7])
                    + row[10] * np.array(row[11])
                    + row[12] * np.array(row[13])
                )
                moment += np.cross(row[6], sign * contact)
            force_error = np.maximum(force_error, np.abs(force - (after - before) / world.dt))
            moment_error = np.maximum(
                moment_error, np.abs(moment - (turning_after - turning_before) / world.dt)
            )
    finally:
        world.close()
    return force_error / weight, moment_error / weight


@pytest.mark.parametrize("order", ["robot_first", "ground_first"])
@pytest.mark.parametrize("kind", ["plane", "box", "heightfield", "step"])
def test_forces_and_moments_change_the_momentum_on_30_degrees(kind: str, order: str) -> None:
    force, moment = residuals(kind, order, 30.0)
    assert force.max() < BOUND, f"force residual {force} of the weight"
    assert moment.max() < BOUND, f"moment residual {moment} of the weight at 1 m"


@pytest.mark.parametrize("kind", ["bench", "patches", "loose", "loose_rock", "elevation"])
def test_forces_and_moments_change_the_momentum_on_uneven_soft_and_loose_ground(kind: str) -> None:
    force, moment = residuals(kind, "robot_first", 45.0)
    assert force.max() < BOUND, f"force residual {force} of the weight"
    assert moment.max() < BOUND, f"moment residual {moment} of the weight at 1 m"


@pytest.mark.slow
@pytest.mark.parametrize("slope", [0.0, 60.0, 80.0])
@pytest.mark.parametrize("order", ["robot_first", "ground_first"])
@pytest.mark.parametrize("kind", list(GROUNDS))
def test_forces_and_moments_change_the_momentum(kind: str, order: str, slope: float) -> None:
    force, moment = residuals(kind, order, slope)
    assert force.max() < BOUND, f"force residual {force} of the weight"
    assert moment.max() < BOUND, f"moment residual {moment} of the weight at 1 m"


def test_recorded_forces_carry_the_weight_while_standing() -> None:
    """From the recorded columns alone: feet + ropes = weight upwards, nothing sideways, within 0.5
    % of the weight.
    """
    world = Simulation(
        load_scenario("stand_slope_45", ["hydraulics.valves_locked=true"], duration=2.0)
    )
    try:
        _, truth = world.run_block(2000)
        columns = {name: truth[:, i] for i, name in enumerate(world.truth_columns)}
    finally:
        world.close()
    names = [f"foot_force_in_world_{leg}" for leg in ("fl", "fr", "rl", "rr")]
    names += ["rope_force_in_world_left", "rope_force_in_world_right"]
    total = np.stack([sum(columns[f"{n}_{k}"] for n in names) for k in "xyz"], axis=1).mean(axis=0)
    weight = 4000.0 * 9.81
    assert np.abs(total - [0.0, 0.0, weight]).max() < BOUND * weight


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("drill_slope_45", ["task.start_s=0.05"]),
        (
            "drill_slope_45",
            ["task.start_s=0.05", "terrain.kind=heightfield", "terrain.roughness_m=0.05"],
        ),
        ("stand_slope_45", ["events=[{kind: lift_foot, at_s: 0.3, leg: rr, duration_s: 1.2}]"]),
    ],
)
def test_forces_from_the_legs_motion_are_the_engines_contact_forces(
    name: str, overrides: list[str]
) -> None:
    """Each foot's force by its leg's equations of motion against the engine's contact points,
    within 5 N of 15 kN.

    But for steps in which a foot takes up or leaves a point of rough ground: the engine's solver
    then stops short.
    """
    world = Simulation(load_scenario(name, overrides, duration=4.0))
    board, force, normal = world.machine.board, np.zeros((4, 3)), np.zeros(4)
    apart, lifted = [], 0
    try:
        for _ in range(300):
            world.run_block(10)
            world.machine.engine.feet.forces(force, normal)
            apart.append(float(np.abs(force - board.foot_force).max()))
            lifted += int((normal == 0.0).any())
    finally:
        world.close()
    rough = any("heightfield" in change for change in overrides)
    assert np.quantile(apart, 0.99) < 5.0
    assert max(apart) < (100.0 if rough else 5.0)
    assert lifted > 0 or name != "stand_slope_45"
