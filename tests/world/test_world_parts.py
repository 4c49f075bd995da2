"""The parts of the world one by one, against hand-computed numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shipped import shipped_model

from testbed import resources
from testbed.control.valve_loop import PositionLoop, valve_command
from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.robot.robot import LegKinematics, length
from testbed.robot.urdf.merge import merged
from testbed.scenario.parts import Sensors
from testbed.scenario.scenario import load_scenario
from testbed.scenario.tasks import Drill, Hammer, PullOut, Push, RodChange
from testbed.scenario.terrain import Terrain
from testbed.world import plant, sensing
from testbed.world.board import Board, BodyState, EngineState
from testbed.world.drilling.drilling import DrillProgram
from testbed.world.ground.terrain import make_ground, rough_surface
from testbed.world.verdict import Judge


def test_welding_fixed_links_changes_no_inertia() -> None:
    """The whole robot's joint-space inertia before and after, at a random posture, to 1e-9."""
    pin = pytest.importorskip("pinocchio")
    text = resources.urdf().read_text()
    first, second = (
        pin.buildModelFromXML(t, pin.JointModelFreeFlyer())
        for t in (text, merged(text, ("rod_store",)))
    )
    q = pin.randomConfiguration(first, -np.ones(first.nq), np.ones(first.nq))
    one, two = (pin.crba(m, m.createData(), q) for m in (first, second))
    assert np.allclose(np.triu(one), np.triu(two), rtol=1e-9, atol=1e-7)
    assert text.count("<link ") - merged(text).count("<link ") == 9


def test_two_boxes_welded_by_hand() -> None:
    """1 kg at x = 0 and 3 kg at x = 2: centre at 1.5 m, inertia about z = own + 1 * 2.25 + 3 * 0.25
    = 0.1 + 0.2 + 3.
    """
    inertial = '<inertial><mass value="{m}"/><inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/></inertial>'
    text = (
        f'<robot name="r"><link name="a">{inertial.format(m=1, i=0.1)}</link>'
        f'<link name="b">{inertial.format(m=3, i=0.2)}</link>'
        '<joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="2 0 0"/></joint></robot>'
    )
    out = merged(text)
    assert 'xyz="1.5 0.0 0.0"' in out
    assert 'izz="3.3"' in out and 'ixx="0.3' in out


def test_a_copy_of_the_board_is_a_snapshot() -> None:
    boards = Board.zeros()
    boards[0].engine.joint[3] = 7.0
    snapshot = boards.copy()
    boards[0].axes[2].a.pressure = 1e5
    assert snapshot[0].engine.joint[3] == 7.0 and snapshot[0].axes[2].a.pressure == 0.0


def test_velocities_from_two_poses_are_exact() -> None:
    """A body that turns at 0.3 rad/s about z and moves at (1, 2, 3) m/s for 1 ms."""
    body, turn = BodyState.zeros()[0], np.array([0.0, 0.0, 0.0, 1.0])
    engine = EngineState.of(quaternion=[0.0, 0.0, 0.0, 1.0])
    plant.move_body(body, engine, turn, 1e-3, True)
    half = 0.5 * 0.3e-3
    engine.position, engine.quaternion = [1e-3, 2e-3, 3e-3], [0, 0, math.sin(half), math.cos(half)]
    plant.move_body(body, engine, turn, 1e-3, False)
    assert body.velocity == pytest.approx([1.0, 2.0, 3.0])
    assert body.angular_velocity == pytest.approx([0.0, 0.0, 0.3], abs=1e-9)


def test_rotation_matrix_of_a_quarter_turn() -> None:
    out = np.zeros((3, 3))
    plant.rotation_matrix(np.array([0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)]), out)
    assert out @ [1.0, 0.0, 0.0] == pytest.approx([0.0, 1.0, 0.0])


def test_slope_frame_rises_towards_x() -> None:
    ground = make_ground(Terrain(slope_deg=30.0))
    assert ground.rotation_slope_to_world[:, 0] == pytest.approx([math.sqrt(3) / 2, 0.0, 0.5])
    assert ground.normal_in_world == pytest.approx([-0.5, 0.0, math.sqrt(3) / 2])


def test_rough_rock_has_the_asked_deviation_and_repeats_by_seed() -> None:
    one, two = rough_surface(81, 61, 0.1, 0.05, 3), rough_surface(81, 61, 0.1, 0.05, 3)
    assert one.shape == (81, 61)
    assert one.std() == pytest.approx(0.05)
    assert np.array_equal(one, two)
    assert not np.allclose(one, rough_surface(81, 61, 0.1, 0.05, 4))


def test_legs_forwards_and_backwards_agree_with_pinocchio() -> None:
    legs, model = LegKinematics.from_machine(build_machine()), shipped_model()
    rng = np.random.default_rng(1)
    for _ in range(20):
        joints = rng.uniform(model.limits[:, 0], model.limits[:, 1])
        feet = legs.feet(joints)
        assert np.allclose(feet, model.foot_positions_m(joints), atol=1e-12)
        assert np.allclose(legs.joints(feet), joints, atol=1e-12)


def test_a_legs_reach_is_rounded_as_pythons_own_hypotenuse() -> None:
    rng = np.random.default_rng(0)
    for x, y in rng.uniform(-3.0, 3.0, (5000, 2)).tolist():
        assert length(x, y) == math.hypot(x, y)
    assert length(0.0, 0.0) == 0.0 and length(3.0, 4.0) == 5.0


@pytest.mark.parametrize(
    ("reference", "command"), [(2e-4, 0.0), (5e-3, 0.4), (0.1, 1.0), (-0.1, -1.0), (0.0, 0.0)]
)
def test_valve_loop_closes_within_its_tolerance_and_saturates(
    reference: float, command: float
) -> None:
    loop = PositionLoop.of(proportional=80.0, limit=1.0, tolerance=2.5e-4, reference=reference)
    assert valve_command(loop, 0.0, 1e-3) == pytest.approx(command)


def test_encoder_counts_and_transducer_range() -> None:
    assert sensing.counted(0.123456, 1e-4) == pytest.approx(0.1235)
    assert sensing.counted(0.123456, 0.0) == 0.123456
    numbers = sensing.Transducer.of(gain=1.02, range=1e7, drift=100.0)
    assert sensing.transduce(5e6, 10.0, 0.0, 0.0, numbers) == pytest.approx(5.1e6 + 1000.0)
    assert sensing.transduce(2e7, 0.0, 0.0, 0.0, numbers) == 1e7
    assert sensing.transduce(-1e5, 0.0, 0.0, 0.0, numbers) == 0.0


def test_ripple_swings_about_the_pressure_and_warmth_changes_the_gain() -> None:
    """1 bar at 225 Hz: a quarter of a period after the phase's start the reading is 1 bar
    higher.
    """
    numbers = sensing.Transducer.of(gain=1.0, range=1e7, ripple=1e5, ripple_rate=2 * math.pi * 225)
    quarter = 0.25 / 225.0
    assert sensing.transduce(5e6, quarter, 0.0, 0.0, numbers) == pytest.approx(5.1e6)
    assert sensing.transduce(5e6, 3 * quarter, 0.0, 0.0, numbers) == pytest.approx(4.9e6)
    warm = sensing.Transducer.of(gain=1.0, range=1e7, thermal_gain=2.5e-4)
    assert sensing.transduce(5e6, 0.0, 20.0, 0.0, warm) == pytest.approx(5e6 * 1.005)


def test_the_amplifier_takes_most_of_the_ripple_before_it_is_sampled() -> None:
    """A bandwidth of 25 Hz leaves 1 / sqrt(1 + 81) of 225 Hz."""
    changes = {"sensor.pressure_ripple_pa": 1e5, "sensor.transducer_bandwidth_hz": 25.0}
    machine = build_machine(changes | {"sensor.rate_bias_rad_s": 5e-3})
    t, other = sensing.sensor_records(machine, Sensors(), np.random.default_rng(1))
    assert t["ripple"] == pytest.approx(np.full((2, 12), 1e5 / math.sqrt(82.0)))
    assert np.ptp(t["ripple_phase"]) > 3.0
    assert 0.0 < np.abs(other["rate_bias"]).max() <= 5e-3
    quiet, exact = sensing.sensor_records(
        machine, Sensors(noise=False, without=("inertial",)), np.random.default_rng(1)
    )
    assert not quiet["ripple"].any() and not exact["rate_bias"].any()


@pytest.mark.parametrize("reading", [4.2e6, 0.0])
def test_a_failed_transducer_shows_the_same_whatever_the_pressure(reading: float) -> None:
    numbers = sensing.Transducer.of(gain=1.0, range=1e7, drift=50.0, noise=8e3)
    sensing.fail(numbers, reading)
    assert [sensing.transduce(p, t, 5.0, 1.3, numbers) for p, t in ((1e6, 0.0), (9e6, 30.0))] == [
        reading,
        reading,
    ]


def test_drill_program_ramps_moves_rods_and_ends() -> None:
    phases = (
        Hammer(kind="hammer", duration_s=4.0, feed_n=5000.0, penetration_m_s=0.01),
        RodChange(kind="rod_change", duration_s=2.0, rod_kg=10.2),
        PullOut(kind="pull_out", duration_s=2.0, pull_n=8000.0),
    )
    program = DrillProgram(Drill(kind="drill", start_s=1.0, ramp_s=0.5, phases=phases))
    assert not program.update(0.5, 0.01)
    assert program.update(1.25, 0.01)
    assert program.loads.feed == pytest.approx(2500.0)
    for k in range(125, 700):
        program.update(k / 100, 0.01)
    assert program.loads.string_mass == pytest.approx(10.2)
    assert program.store_change_kg == pytest.approx(-10.2)
    assert program.loads.depth == pytest.approx(0.0375, abs=2e-3)
    program.update(8.0, 0.01)
    assert program.loads.pull == pytest.approx(8000.0)
    assert program.update(9.5, 0.01)
    assert program.loads.pull == 0.0 and program.phase == "done"


def test_a_drill_that_begins_again_finds_its_phase_where_the_sum_of_times_rounds_up() -> None:
    push = Push(kind="push", duration_s=11.2)
    program = DrillProgram(Drill(kind="drill", start_s=6.4, repeat=True, phases=(push,)))
    assert divmod(40.0 - 6.4, (6.4 + 11.2) - 6.4)[1] + 6.4 >= 6.4 + 11.2
    program.update(40.0, 0.01)
    assert program.phase == "push"


def test_a_machine_whose_feet_have_left_the_ground_and_gone_on_has_fallen() -> None:
    none, every, feet = np.zeros(4, dtype=bool), np.ones(4, dtype=bool), np.zeros((4, 3))
    judge = Judge(np.eye(3), 4e4, raised=True)
    down = np.array([0.0, 0.0, -0.3])
    assert judge.look(0.0, np.eye(3), feet, every, none, 0.0) is None
    assert judge.look(0.1, np.eye(3), feet + down, every, none, 0.0) is None
    assert (
        judge.look(0.2, np.eye(3), feet + 2 * down, every, every, 0.0) is None
    )  # it has come down: a jump
    assert judge.look(0.3, np.eye(3), feet + 3 * down, every, none, 0.0) is None
    assert judge.look(0.4, np.eye(3), feet + 5 * down, every, none, 0.0) is not None
    assert judge.verdict == "fell"


def test_judge_tells_fall_and_slide() -> None:
    feet, all_feet = np.zeros((4, 3)), np.ones(4, dtype=bool)
    judge = Judge(np.eye(3), 4e4, raised=True)
    assert judge.look(0.0, np.eye(3), feet, all_feet, all_feet, 0.0) is None
    moved = feet + np.array([0.31, 0.0, 0.0])
    assert judge.look(1.0, np.eye(3), moved, all_feet, all_feet, 0.0) is not None
    assert judge.verdict == "slid" and judge.slip_m == pytest.approx(0.31)
    c, s = math.cos(0.5), math.sin(0.5)
    tipped = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    judge = Judge(np.eye(3), 4e4, raised=True)
    assert judge.look(0.0, tipped, feet, all_feet, all_feet, 0.0) is not None
    assert judge.verdict == "fell" and judge.turn_rad == pytest.approx(0.5)


def test_an_impossible_start_posture_is_refused_by_name() -> None:
    with pytest.raises(InputError, match=r"robot\.radial_m = 0\.45: .* at fl"):
        load_scenario("stand_flat", ["robot.radial_m=0.45"])


def test_quaternions_and_roll_pitch_yaw_give_back_their_rotation() -> None:
    from testbed.machine.urdf_shapes import rotation_from_rpy
    from testbed.robot.urdf.merge import rpy_from_rotation
    from testbed.world.view import quaternion

    rng = np.random.default_rng(5)
    for rpy in (
        *rng.uniform(-1.5, 1.5, (50, 3)).tolist(),
        [0.3, math.pi / 2, 0.2],
        [3.0, 0.1, -3.1],
    ):
        rotation, back = rotation_from_rpy(rpy), np.zeros((3, 3))
        plant.rotation_matrix(quaternion(rotation), back)
        assert np.allclose(back, rotation, atol=1e-12)
        assert np.allclose(rotation_from_rpy(rpy_from_rotation(rotation)), rotation, atol=1e-9)
    assert quaternion(rotation_from_rpy([0.0, 0.0, math.pi])) == pytest.approx(
        [0.0, 0.0, 1.0, 0.0], abs=1e-12
    )
