"""Effects of the whole robot change the world by the stated size; what estimators and control
believe stays.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from numpy.typing import NDArray

from testbed.machine.names import GRAVITY_M_S2, LEGS
from testbed.recording.rows import DataRow
from testbed.scenario.scenario import load_scenario
from testbed.world.sensing import Noise, sense
from testbed.world.simulation import Simulation

Array = NDArray[np.float64]


@contextmanager
def world(
    name: str, effect: str = "", at: str = "body", more: tuple[str, ...] = (), **parameters: float
) -> Iterator[Simulation]:
    """A run of a scenario whose world has one effect that its model lacks; none by default."""
    hidden = [{"effect": effect, "at": at, "parameters": parameters}] if effect else []
    quiet = ["sensors.noise=false", "sensors.thermal_drift=false", *more]
    scenario = load_scenario(name, [*quiet, f"undeclared={json.dumps(hidden)}"], duration=20.0)
    simulation = Simulation(scenario)
    try:
        yield simulation
    finally:
        simulation.machine.engine.close()


def columns(simulation: Simulation, rows: int) -> dict[str, Array]:
    """The next rows of data and truth, by name."""
    data, truth = simulation.run_block(rows)
    found = {name: truth[:, k] for k, name in enumerate(simulation.truth_columns)}
    return found | {name: data[:, k] for k, name in enumerate(simulation.data_columns)}


def mean_load_n(simulation: Simulation, rows: int = 1500) -> Array:
    """Load of each foot along its leg, over the last third of the next rows, (4,), N."""
    found = columns(simulation, rows)
    return np.array([found[f"foot_load_{leg}"][-rows // 3 :].mean() for leg in LEGS])


def test_a_payload_weighs_on_the_feet_and_not_in_the_model() -> None:
    with world("stand_flat") as sound:
        before, model = mean_load_n(sound), sound.machine.belief.model.total_mass_kg
        masses = sound.machine.engine.masses()
    with world("stand_flat", "robot.payload", mass=100.0, x=0.3, y=0.0, z=0.2) as loaded:
        after = mean_load_n(loaded)
        assert loaded.machine.belief.model.total_mass_kg == model
        assert (loaded.machine.engine.masses() - masses).sum() == pytest.approx(100.0)
        assert loaded.machine.kinematics.total_mass_kg == pytest.approx(model + 100.0)
    gain = after - before
    assert gain.sum() == pytest.approx(100.0 * GRAVITY_M_S2, rel=0.02)
    assert gain[:2].sum() > 1.2 * gain[2:].sum()  # it lies in front of the middle


def test_a_shifted_centre_of_mass_moves_load_and_adds_none() -> None:
    with world("stand_flat") as sound:
        before = mean_load_n(sound)
        joints = sound.machine.start_joints
        centre = sound.machine.kinematics.centre_of_mass_m(joints)
        masses = sound.machine.engine.masses()
        base = sound.machine.engine.base_inertial_m * masses[0]
    with world("stand_flat", "robot.centre_of_mass", x=0.0, y=0.1, z=0.0) as shifted:
        after = mean_load_n(shifted)
        moved = shifted.machine.kinematics.centre_of_mass_m(joints) - centre
        assert shifted.machine.engine.masses() == pytest.approx(masses)
        # The engine has the same moment of mass as the model of the truth.
        moment = shifted.machine.engine.base_inertial_m * masses[0] - base
        assert moment == pytest.approx(moved * masses.sum(), rel=1e-6, abs=1e-6)
        believed = shifted.machine.belief.model.centre_of_mass_m(joints)
        assert believed == pytest.approx(centre, abs=1e-12)
    assert moved[1] > 0.02 and abs(moved[0]) < 1e-9
    assert (after - before).sum() == pytest.approx(0.0, abs=0.002 * before.sum())
    width = float(np.ptp(shifted.machine.kinematics.foot_positions_m(joints)[:, 1]))
    to_the_left = (after - before)[[0, 2]].sum()
    assert to_the_left == pytest.approx(moved[1] / width * before.sum(), rel=0.1)


def test_ropes_of_another_stiffness_pull_as_told_at_the_start() -> None:
    with (
        world("stand_slope_45") as sound,
        world("stand_slope_45", "rope.stiffness", "rope", factor=0.5) as soft,
    ):
        first, other = (columns(s, 50) for s in (sound, soft))
        for side in ("left", "right"):
            name = f"rope_tension_{side}"
            assert other[name][0] == pytest.approx(first[name][0], rel=1e-3)
        stiffness = [s.machine.board.ropes["stiffness_ea"] for s in (sound, soft)]
        assert stiffness[1] == pytest.approx(0.5 * stiffness[0])


def test_an_anchor_elsewhere_turns_the_rope_by_the_angle_and_nobody_is_told() -> None:
    def direction(s: Simulation) -> Array:
        found = columns(s, 5)
        force = [found[f"rope_force_in_world_left_{axis}"][0] for axis in "xyz"]
        return np.array(force) / np.linalg.norm(force)

    with (
        world("stand_slope_45") as sound,
        world(
            "stand_slope_45", "rope.direction", "rope_left", azimuth=0.1, elevation=0.0
        ) as turned,
    ):
        believed = [s.machine.expectation.rope_directions_in_world for s in (sound, turned)]
        assert np.array_equal(*believed)
        slope = sound.machine.ground.rotation_slope_to_world
        before, after = (slope.T @ direction(s) for s in (sound, turned))
    angle = np.arctan2(after[1], after[0]) - np.arctan2(before[1], before[0])
    assert angle == pytest.approx(0.1, abs=2e-3)
    assert after[2] == pytest.approx(before[2], abs=2e-3)


def test_the_ground_gives_way_under_one_foot_at_its_rate_and_to_its_depth() -> None:
    with world("stand_flat", "ground.settling", "foot_fr", rate=2e-4, depth=2.5e-4) as soft:
        footing = soft.machine.footing
        assert footing is not None
        soft.run_block(1000)
        assert footing.settlement_m == pytest.approx([0.0, 2e-4, 0.0, 0.0], abs=5e-6)
        found = columns(soft, 1000)
        assert footing.settlement_m == pytest.approx([0.0, 2.5e-4, 0.0, 0.0], abs=1e-9)
        assert soft.machine.settlement()["settlement_m"]["fr"] == pytest.approx(2.5e-4)
    load = [found[f"foot_load_{leg}"][-1] for leg in LEGS]
    assert load[1] + load[2] < 0.95 * (load[0] + load[3])  # its diagonal loses load


def test_a_foot_on_slippery_ground_holds_no_more_than_its_friction() -> None:
    def used(s: Simulation) -> Array:
        found = columns(s, 400)
        normal = s.machine.ground.normal_in_world
        ratios = []
        for leg in LEGS:
            force = [found[f"foot_force_in_world_{leg}_{axis}"][-1] for axis in "xyz"]
            along = float(np.dot(force, normal))
            ratios.append(float(np.linalg.norm(np.array(force) - along * normal)) / along)
        return np.array(ratios)

    slack = ("ropes.enabled=false", "terrain.slope_deg=25", "terrain.friction=0.8")
    with world("stand_slope_45", more=slack) as sound:
        rough = used(sound)
    with world("stand_slope_45", "ground.friction", "foot_rl", slack, coefficient=0.2) as icy:
        smooth = used(icy)
    assert rough[2] > 0.3
    assert smooth[2] <= 0.2 * 1.02
    assert min(np.delete(smooth, 2)) > 0.3


def test_the_drill_pushes_otherwise_than_ordered() -> None:
    def pushed(s: Simulation) -> tuple[float, float]:
        found = columns(s, 1500)
        axis = s.machine.ground.normal_in_world
        wrench = [found[f"drill_wrench_in_world_f{k}"][-1] for k in "xyz"]
        return float(np.dot(wrench, axis)), float(found["ordered_thrust"][-1])

    early = ("task.start_s=0.05",)
    with world("drill_slope_45", more=early) as sound:
        thrust, ordered = pushed(sound)
    with world("drill_slope_45", "drill.thrust", "drill", early, factor=1.3) as strong:
        more, still_ordered = pushed(strong)
    assert ordered == still_ordered > 1000.0
    assert more - thrust == pytest.approx(0.3 * ordered, rel=0.02)


def test_a_worn_pump_holds_a_lower_pressure_and_gives_less() -> None:
    constant = ("machine.set=original",)
    with world("stand_flat", more=constant) as sound:
        declared = columns(sound, 300)["supply_pressure"][-1]
        flow = float(sound.machine.board.unit.pump_flow)
    less = {"flow_factor": 0.6, "pressure_factor": 0.8}
    with world("stand_flat", "supply.pump", "supply", constant, **less) as worn:
        held = columns(worn, 300)["supply_pressure"][-1]
        assert worn.machine.board.unit.pump_flow == pytest.approx(0.6 * flow)
    assert held == pytest.approx(0.8 * declared, rel=0.02)


def first_reading(name: str, **hidden: float | str) -> dict[str, float]:
    """What the sensors read first, before anything answers to it."""
    exact = ("sensors.quantisation=false",)
    effect, at = str(hidden.pop("effect", "")), str(hidden.pop("at", "body"))
    numbers = {key: float(value) for key, value in hidden.items()}
    with world(name, effect, at, exact, **numbers) as simulation:
        return {key: float(values[0]) for key, values in columns(simulation, 1).items()}


def test_an_encoder_reads_its_offset_too_much() -> None:
    sound = first_reading("stand_flat")
    shifted = first_reading(
        "stand_flat", effect="sensor.encoder_offset", at="rl_radial", offset=0.01
    )
    assert shifted["position_rl_radial"] - sound["position_rl_radial"] == pytest.approx(
        0.01, abs=1e-4
    )
    assert shifted["position_rl_vertical"] == pytest.approx(sound["position_rl_vertical"], abs=1e-4)


def test_a_load_pin_reads_another_tension_than_the_rope_has() -> None:
    sound = first_reading("stand_slope_45")
    wrong = first_reading(
        "stand_slope_45", effect="rope.tension_gain", at="rope_right", gain_error=0.1, zero=300.0
    )
    assert wrong["rope_tension_right"] == pytest.approx(
        1.1 * sound["rope_tension_right"] + 300.0, rel=1e-3
    )
    assert wrong["rope_tension_left"] == pytest.approx(sound["rope_tension_left"], rel=1e-3)


def test_a_unit_askew_reads_another_attitude_and_gravity_along_other_axes() -> None:
    sound = first_reading("stand_slope_45")
    askew = first_reading("stand_slope_45", effect="robot.attitude", roll=0.03, pitch=-0.05)
    assert askew["attitude_roll"] - sound["attitude_roll"] == pytest.approx(0.03, abs=1e-4)
    assert askew["attitude_pitch"] - sound["attitude_pitch"] == pytest.approx(-0.05, abs=1e-4)
    force = np.array([askew[f"specific_force_{axis}"] for axis in "xyz"])
    roll, pitch = askew["attitude_roll"], askew["attitude_pitch"]
    upward = [-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)]
    assert force / np.linalg.norm(force) == pytest.approx(np.array(upward), abs=5e-3)


def test_a_joint_with_play_moves_before_its_encoder_follows() -> None:
    with world("stand_flat", "joint.play", "fl_rotation", half_width=0.004) as simulation:
        board = simulation.machine.boards[0]
        row, noise = DataRow.zeros()[0], Noise.zeros()[0]
        shown = []
        for angle in (0.02, 0.017, 0.013, 0.010):
            board.engine.joint[0] = angle
            sense(row, board, noise, 0.0, 0)
            shown.append(row.position[0])
    np.testing.assert_allclose(shown, [0.016, 0.016, 0.016, 0.014], atol=4e-4)


def test_a_leg_that_hangs_elsewhere_stands_elsewhere() -> None:
    with world("stand_flat", "leg.hinge", "rr", x=0.02, y=-0.01, z=0.005) as simulation:
        q = simulation.machine.start_joints
        true = simulation.machine.kinematics.foot_positions_m(q)
        believed = simulation.machine.belief.model.foot_positions_m(q)
    moved = np.zeros((4, 3))
    moved[LEGS.index("rr")] = (0.02, -0.01, 0.005)
    np.testing.assert_allclose(true - believed, moved, atol=1e-9)
