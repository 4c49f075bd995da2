"""Pinocchio, PyBullet and MuJoCo read the same machine from the same file; a broken file is refused
in one line.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pybullet
import pytest
from shipped import shipped_model, slope_gravity

from testbed import resources
from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.machine.names import AXES, GRAVITY_M_S2, LEGS, VERTICAL
from testbed.robot.model import (
    Payload,
    RobotModel,
    attitude_gravity,
)
from testbed.robot.urdf.generate import urdf_text

MODEL = shipped_model()
RNG = np.random.default_rng(20)
POSTURES = [RNG.uniform(MODEL.limits[:, 0], MODEL.limits[:, 1]) for _ in range(20)]
DIRECTIONS = [v / np.linalg.norm(v) for v in RNG.normal(size=(20, 3))]
STANCE = np.tile([0.0, 0.2, 0.25], 4)


def assert_close(found: Any, expected: Any) -> None:
    """Equal to 1e-6 of the largest entry."""
    expected = np.asarray(expected)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


class Bullet:
    """The URDF in PyBullet, floating, inertia from the file."""

    def __init__(self) -> None:
        self.client = pybullet.connect(pybullet.DIRECT)
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE
        self.robot = pybullet.loadURDF(
            str(resources.urdf()), flags=flags, physicsClientId=self.client
        )
        count = pybullet.getNumJoints(self.robot, physicsClientId=self.client)
        names = [
            pybullet.getJointInfo(self.robot, j, physicsClientId=self.client)[1].decode()
            for j in range(count)
        ]
        self.count, self.joints = count, [names.index(name) for name in AXES]
        moving = [name for name in names if name in AXES]
        self.to_axes = np.array([moving.index(name) for name in AXES])

    def ordered(self, positions: np.ndarray) -> list[float]:
        out = np.empty(12)
        out[self.to_axes] = positions
        return list(out)

    def masses(self) -> np.ndarray:
        info = [
            pybullet.getDynamicsInfo(self.robot, j, physicsClientId=self.client)
            for j in range(-1, self.count)
        ]
        return np.array([i[0] for i in info])

    def centre_of_mass(self, positions: np.ndarray) -> np.ndarray:
        for joint, value in zip(self.joints, positions, strict=True):
            pybullet.resetJointState(self.robot, joint, value, physicsClientId=self.client)
        links = [
            pybullet.getLinkState(self.robot, j, 0, 1, physicsClientId=self.client)[0]
            for j in range(self.count)
        ]
        base = pybullet.getBasePositionAndOrientation(self.robot, physicsClientId=self.client)[0]
        return self.masses() @ np.array([base, *links]) / self.masses().sum()

    def mass_matrix(self, positions: np.ndarray) -> np.ndarray:
        full = np.array(
            pybullet.calculateMassMatrix(
                self.robot, self.ordered(positions), physicsClientId=self.client
            )
        )
        order = np.concatenate([[3, 4, 5, 0, 1, 2], 6 + self.to_axes])
        return full[np.ix_(order, order)]

    def gravity_forces(self, positions: np.ndarray, gravity: np.ndarray) -> np.ndarray:
        pybullet.setGravity(*gravity, physicsClientId=self.client)
        pose = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, *self.ordered(positions)]
        still = [0.0] * 18
        force = pybullet.calculateInverseDynamics(
            self.robot, pose, still, still, physicsClientId=self.client
        )
        return np.array(force)[np.concatenate([np.arange(6), 6 + self.to_axes])]


class Mujoco:
    """The URDF in MuJoCo, hung on a free joint."""

    def __init__(self) -> None:
        spec = mujoco.MjSpec.from_string(resources.urdf().read_text())
        spec.worldbody.first_body().add_freejoint()
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        joints = [self.model.joint(name) for name in AXES]
        self.q_index = np.array([j.qposadr[0] for j in joints])
        self.order = np.concatenate([np.arange(6), [j.dofadr[0] for j in joints]])

    def pose(self, positions: np.ndarray, gravity: np.ndarray) -> None:
        self.data.qpos[:7] = (0, 0, 0, 1, 0, 0, 0)
        self.data.qpos[self.q_index] = positions
        self.data.qvel[:] = 0.0
        self.model.opt.gravity[:] = gravity
        mujoco.mj_forward(self.model, self.data)

    def mass_matrix(self) -> np.ndarray:
        full = np.zeros((18, 18))
        for column, unit in zip(full, np.eye(18), strict=True):
            mujoco.mj_mulM(self.model, self.data, column, unit)
        return full[np.ix_(self.order, self.order)]


@pytest.fixture(scope="module")
def bullet() -> Any:
    engine = Bullet()
    yield engine
    pybullet.disconnect(engine.client)


@pytest.fixture(scope="module")
def other() -> Mujoco:
    return Mujoco()


def test_the_machine_weighs_four_tonnes_in_all_three_readers(bullet: Bullet, other: Mujoco) -> None:
    assert MODEL.total_mass_kg == pytest.approx(build_machine().total_mass_kg, rel=1e-12)
    assert bullet.masses().sum() == pytest.approx(4000.0, rel=1e-6)
    assert other.model.body_mass.sum() == pytest.approx(4000.0, rel=1e-6)


def test_centre_of_mass_agrees_at_20_postures(bullet: Bullet, other: Mujoco) -> None:
    for posture in POSTURES:
        centre = MODEL.centre_of_mass_m(posture)
        assert_close(bullet.centre_of_mass(posture), centre)
        other.pose(posture, np.array([0.0, 0.0, -9.81]))
        assert_close(other.data.subtree_com[1], centre)


def test_mass_matrix_with_the_base_agrees_at_20_postures(bullet: Bullet, other: Mujoco) -> None:
    for posture in POSTURES:
        matrix = MODEL.mass_matrix(posture)
        np.testing.assert_array_equal(matrix, matrix.T)
        assert_close(bullet.mass_matrix(posture), matrix)
        other.pose(posture, np.zeros(3))
        assert_close(other.mass_matrix(), matrix)


def test_gravity_torques_agree_at_20_postures_and_attitudes(bullet: Bullet, other: Mujoco) -> None:
    for posture, direction in zip(POSTURES, DIRECTIONS, strict=True):
        forces = MODEL.gravity_forces(posture, GRAVITY_M_S2 * direction)
        assert_close(bullet.gravity_forces(posture, GRAVITY_M_S2 * direction), forces)
        other.pose(posture, GRAVITY_M_S2 * direction)
        assert_close(other.data.qfrc_bias[other.order], forces)


def test_inverse_dynamics_is_mass_matrix_times_acceleration_plus_gravity_at_rest() -> None:
    acceleration = RNG.normal(size=18)
    gravity = slope_gravity(0.7)
    expected = MODEL.mass_matrix(POSTURES[0]) @ acceleration + MODEL.gravity_forces(
        POSTURES[0], gravity
    )
    assert_close(MODEL.inverse_dynamics(POSTURES[0], np.zeros(18), acceleration, gravity), expected)


def test_a_hanging_vertical_joint_holds_900_newtons_on_level_ground() -> None:
    held = MODEL.gravity_forces(STANCE, [0.0, 0.0, -GRAVITY_M_S2])
    # Extension is downwards, gravity pulls the 91.7 kg frame out: the joint holds it back with
    # -899.6 N.
    np.testing.assert_allclose(held[6 + np.array(VERTICAL)], -91.7 * 9.81, rtol=1e-12)
    np.testing.assert_allclose(held[:3], [0.0, 0.0, 4000.0 * 9.81], atol=1e-6)


def test_slope_45_turns_the_weight_halfway_towards_downhill() -> None:
    half = 9.81 / np.sqrt(2.0)
    np.testing.assert_allclose(slope_gravity(np.pi / 4), [-half, 0.0, -half])
    np.testing.assert_allclose(
        attitude_gravity(0.0, -np.pi / 4), slope_gravity(np.pi / 4), atol=1e-15
    )
    np.testing.assert_allclose(attitude_gravity(np.pi / 2, 0.0), [0.0, -9.81, 0.0], atol=1e-15)


def test_feet_stand_where_the_arms_reach() -> None:
    points = MODEL.foot_positions_m(STANCE)
    across = 0.4 + 0.7 * np.sin(np.pi / 3)
    expected = [
        [1.25, across, -0.41],
        [1.25, -across, -0.41],
        [-1.25, across, -0.41],
        [-1.25, -across, -0.41],
    ]
    np.testing.assert_allclose(points, expected, atol=1e-9)


def test_footprint_is_about_2_by_2_5_metres() -> None:
    points = MODEL.foot_positions_m(STANCE)
    assert np.ptp(points[:, 0]) == pytest.approx(2.5, abs=0.05)
    assert np.ptp(points[:, 1]) == pytest.approx(2.0, abs=0.05)


def test_retracted_feet_leave_the_belly_on_the_ground() -> None:
    retracted = MODEL.foot_positions_m(np.zeros(12))[:, 2]
    assert np.all(retracted > build_machine().body.belly_height_m)
    assert retracted[0] == pytest.approx(-0.16)


def test_foot_jacobian_is_the_derivative_of_the_foot() -> None:
    posture, step = POSTURES[3], 1e-6
    jacobians = MODEL.feet(posture)[1]
    for axis in range(12):
        shift = np.zeros(12)
        shift[axis] = step
        slope = (
            MODEL.foot_positions_m(posture + shift) - MODEL.foot_positions_m(posture - shift)
        ) / (2 * step)
        np.testing.assert_allclose(jacobians[:, :, axis], slope, atol=1e-8)


def test_a_payload_adds_its_weight_at_its_point() -> None:
    loaded = RobotModel(MODEL.path, Payload(1000.0, (0.3, 0.34, 0.9)))
    assert loaded.total_mass_kg == pytest.approx(5000.0)
    expected = (4 * MODEL.centre_of_mass_m(STANCE) + np.array([0.3, 0.34, 0.9])) / 5
    np.testing.assert_allclose(loaded.centre_of_mass_m(STANCE), expected, atol=1e-12)
    with pytest.raises(InputError, match=r"payload\.mass_kg"):
        RobotModel(MODEL.path, Payload(-1.0, (0.0, 0.0, 0.0)))


def test_the_shipped_urdf_is_what_the_parameters_generate() -> None:
    assert resources.urdf().read_text() == urdf_text(build_machine())


def test_the_urdf_follows_a_changed_number(tmp_path: Path) -> None:
    heavier = build_machine({"legs.foot_mass_kg": 20.0, "traction_body.attachment_height_m": 0.5})
    file = tmp_path / "heavier.urdf"
    file.write_text(urdf_text(heavier))
    model = RobotModel(file)
    assert model.total_mass_kg == pytest.approx(4020.0)
    np.testing.assert_allclose(model.rope_attachments_m, [[1.05, 0.34, 0.5], [1.05, -0.34, 0.5]])


def test_drill_axis_ropes_and_feet_have_their_frames() -> None:
    np.testing.assert_allclose(MODEL.drill_mount_m, [0.05, 0.0, -0.1])
    assert MODEL.foot_radii_m == pytest.approx(0.1)
    assert len(LEGS) == len(MODEL.foot_positions_m(STANCE))


BROKEN = {
    "not XML": (lambda t: t[:500], "is not XML"),
    "another root": (
        lambda t: t.replace("<robot ", "<sdf ").replace("</robot>", "</sdf>"),
        "root element",
    ),
    "no mass": (lambda t: t.replace('<mass value="15" />', "", 1), "fl_foot: has no mass"),
    "mass zero": (
        lambda t: t.replace('<mass value="15" />', '<mass value="0" />', 1),
        "fl_foot mass = 0.0",
    ),
    "a word for a number": (
        lambda t: t.replace('<mass value="15" />', '<mass value="heavy" />', 1),
        "'heavy'",
    ),
    "NaN": (lambda t: t.replace('<mass value="15" />', '<mass value="nan" />', 1), "'nan'"),
    "joint gone": (lambda t: t.replace('name="rl_radial"', 'name="rl_spare"'), "rl_radial"),
    "joint twice": (
        lambda t: t.replace('joint name="rl_radial"', 'joint name="rr_radial"'),
        "appears twice",
    ),
    "wrong type": (
        lambda t: t.replace('fl_rotation" type="revolute', 'fl_rotation" type="fixed'),
        "wrong type",
    ),
    "orphan": (
        lambda t: t.replace('<child link="rod_store" />', '<child link="power_unit" />'),
        "hangs on two joints",
    ),
    "stray parent": (
        lambda t: t.replace('<parent link="fl_radial" />', '<parent link="leg" />'),
        "parent is no link",
    ),
    "one traction device": (
        lambda t: t.replace("traction_left", "winch_left"),
        "link traction_right: has one traction device without the other",
    ),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_a_broken_urdf_is_refused_in_one_line(kind: str, tmp_path: Path) -> None:
    change, words = BROKEN[kind]
    file = tmp_path / "robot.urdf"
    file.write_text(change(resources.urdf().read_text()))
    with pytest.raises(InputError) as caught:
        RobotModel(file)
    message = str(caught.value)
    assert words in message and "robot.urdf" in message and "\n" not in message


def test_a_missing_urdf_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        RobotModel(tmp_path / "none.urdf")


def test_the_ropes_attachment_tips_the_machine_neither_way_at_a_share_of_095() -> None:
    """Weight pulls downhill at the centre of mass, ropes uphill at their height h, feet at their
    soles f:

    s h + (1 - s) f = c, so h = c + (1 - s) / s (c - f).
    """
    share = 0.95
    centre = float(MODEL.centre_of_mass_m(STANCE)[2])
    soles = float(MODEL.foot_positions_m(STANCE)[:, 2].mean())
    balanced = centre + (1.0 - share) / share * (centre - soles)
    assert MODEL.rope_attachments_m[:, 2] == pytest.approx([balanced] * 2, abs=0.002)
