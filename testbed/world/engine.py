"""The bodies and their contacts: the one file that speaks to PyBullet."""

from __future__ import annotations

import contextlib
import sys
import tempfile
import weakref
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from struct import Struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError, SimulationFault
from testbed.formats.arrays import Array
from testbed.machine.names import AXES, GRAVITY_M_S2, LEGS
from testbed.machine.urdf_check import read_urdf
from testbed.robot.urdf.merge import merged
from testbed.world.foot_contacts import FootContacts
from testbed.world.ground.terrain import Ground, ground_shape
from testbed.world.view import View, quaternion, quiet

NEAR_M = 1.0e-3
"""Contact points further from touching than this are left out of a step (a foot comes down by 0.1
mm in one).
"""
APART_M = 0.1
"""So far apart two bodies have no points of contact."""
with quiet():
    try:
        import pybullet as p
        from pybullet_utils.bullet_client import BulletClient
    except ImportError as error:
        raise InputError(
            f"the physics engine PyBullet is not installed for Python {sys.version_info[0]}.{sys.version_info[1]}; its "
            "wheels stop at 3.11, and nothing that simulates works without it",
            allowed="Python 3.11 for what simulates; recordings, estimates, diagnosis and pages work on later ones",
        ) from error


class Engine:
    """One engine client with the robot and its ground.

    Poses and forces are in the world frame (z up). The robot's base pose refers to the **origin of
    the link `body`**, not to the centre of mass that the engine speaks of. Joints are free: what
    holds them are the torques handed in at every step; friction and end stops belong to the
    hydraulics.
    """

    def __init__(
        self,
        urdf: Path,
        ground: Ground,
        *,
        step_s: float,
        robot_first: bool = True,
        gui: bool = False,
        iterations: int = 50,
        sinking: bool = False,
    ) -> None:
        with quiet():  # the client prints its options
            self.bullet = BulletClient(p.GUI if gui else p.DIRECT)
        if not self.bullet.getConnectionInfo()["isConnected"]:
            raise SimulationFault("the physics engine gave no client")
        self._given_back = weakref.finalize(self, _disconnect, self.bullet)
        # Called at every step: bound once.
        self._joint_states = self.bullet.getJointStates
        self._base_pose = self.bullet.getBasePositionAndOrientation
        self._drive_joints = self.bullet.setJointMotorControlArray
        self._push = self.bullet.applyExternalForce
        self._turn = self.bullet.applyExternalTorque
        self._advance = self.bullet.stepSimulation
        self._state: NDArray[Any] | None = None
        self._given: NDArray[Any] | None = None
        self._foot_grounds: list[int] = []
        self._centre: Sequence[float] = (0.0, 0.0, 0.0)
        self._footing = np.zeros((len(LEGS), 3))
        """Friction, stiffness and damping of the ground under each foot."""
        self._friction = ground.friction
        """Of the ground where the robot touches it with anything but a foot."""
        self._sunk_m = np.zeros(len(LEGS))
        self.bullet.setGravity(0, 0, -GRAVITY_M_S2)
        self.bullet.setPhysicsEngineParameter(
            fixedTimeStep=step_s, numSolverIterations=iterations, numSubSteps=0
        )
        if robot_first:
            self._load_robot(urdf)
            self._load_ground(ground)
        else:
            self._load_ground(ground)
            self._load_robot(urdf)
        if sinking:
            self._part_grounds()
        self._set_dynamics(ground)
        grounds = self._foot_grounds or [self.ground] * len(LEGS)
        self.feet = FootContacts(self.bullet, self.robot, self.foot_links, grounds)
        self.view = View(self.bullet, self.ground)

    # ---- loading ---------------------------------------------------------------------------------

    def _load_robot(self, urdf: Path) -> None:
        try:
            with quiet(), tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
                # The engine's own welding of fixed links would lose products of inertia.
                file.write(merged(read_urdf(urdf), keep=("rod_store",)))
                file.flush()
                self.robot = self.bullet.loadURDF(file.name, flags=p.URDF_USE_INERTIA_FROM_FILE)
        except p.error as error:
            raise InputError("the engine cannot load this URDF", file=urdf) from error
        info = [
            self.bullet.getJointInfo(self.robot, index)
            for index in range(self.bullet.getNumJoints(self.robot))
        ]
        by_name = {row[1].decode(): row[0] for row in info}
        missing = [name for name in AXES if name not in by_name]
        if missing:
            raise InputError("lacks a joint", file=urdf, field=missing[0], allowed=", ".join(AXES))
        self.joints: list[int] = [by_name[name] for name in AXES]
        self._limits = [(info[joint][8], info[joint][9]) for joint in self.joints]
        links = {row[12].decode(): row[0] for row in info}
        self.link_names = {-1: "body"} | {number: name for name, number in links.items()}
        self.foot_links: dict[int, int] = {
            by_name[f"{leg}_vertical"]: index for index, leg in enumerate(LEGS)
        }
        self._others = sorted(set(self.link_names) - set(self.foot_links))
        """Links that are no feet, the body among them."""
        self._store = links.get("rod_store", -1)
        dyn = self.bullet.getDynamicsInfo(self.robot, -1)
        self.base_inertial_m = np.array(dyn[3])
        self.base_turn = np.array(dyn[4])
        """Quaternion xyzw of the base's principal axes in the body frame: what the engine calls its
        orientation.
        """

    def _load_ground(self, ground: Ground) -> None:
        self._shape, self._ground_pose = ground_shape(self.bullet, ground), ground.engine_pose
        self._endless = ground.kind == "plane"
        self.ground = self.bullet.createMultiBody(0, self._shape)
        self.bullet.resetBasePositionAndOrientation(self.ground, *ground.engine_pose())

    def _part_grounds(self) -> None:
        """A ground of its own for each foot, the same shape in the same place: it can sink under
        this foot alone.
        """
        others = set(range(-1, self.bullet.getNumJoints(self.robot)))
        for foot in self.foot_links:
            body = self.bullet.createMultiBody(0, self._shape)
            self.bullet.resetBasePositionAndOrientation(body, *self._ground_pose())
            self._foot_grounds.append(body)
            for link in others - {foot}:
                self.bullet.setCollisionFilterPair(self.robot, body, link, -1, 0)
            self.bullet.setCollisionFilterPair(self.robot, self.ground, foot, -1, 0)

    def _set_dynamics(self, g: Ground) -> None:
        links = [-1, *range(self.bullet.getNumJoints(self.robot))]
        self.bullet.changeDynamics(self.robot, -1, linearDamping=0.0)
        self.bullet.changeDynamics(self.robot, -1, angularDamping=0.0)
        for link in links:
            self.bullet.changeDynamics(self.robot, link, jointDamping=0.0)
            self.bullet.changeDynamics(self.robot, link, restitution=0.0)
            self.bullet.changeDynamics(self.robot, link, maxJointVelocity=1e4)
            # End stops live in the hydraulics; the engine's would push unseen and keep on at 1, -1.
            if link >= 0:
                self.bullet.changeDynamics(
                    self.robot, link, jointLowerLimit=-10.0, jointUpperLimit=10.0
                )
        for body, link in [(self.robot, k) for k in (-1, *self.foot_links)] + [
            (ground, -1) for ground in (self.ground, *self._foot_grounds)
        ]:  # on rough ground most contact points hang in the air: the solver need not see them
            self.bullet.changeDynamics(body, link, contactProcessingThreshold=NEAR_M)
        self._put_friction(g.friction)
        for leg in range(len(LEGS)):
            self.set_footing(leg, g.friction, g.stiffness_n_m, g.damping_n_s_m)
        # The product of both bodies' friction counts.
        for ground in (
            self.ground,
            *self._foot_grounds,
        ):
            self.bullet.changeDynamics(ground, -1, lateralFriction=1.0)
            self.bullet.changeDynamics(ground, -1, restitution=0.0)
        self.bullet.setJointMotorControlArray(
            self.robot, self.joints, p.VELOCITY_CONTROL, forces=[0.0] * len(self.joints)
        )

    def set_footing(
        self, leg: int, friction: float, stiffness_n_m: float, damping_n_s_m: float
    ) -> None:
        """What the ground is under one foot: its friction coefficient, stiffness and damping."""
        self._footing[leg] = friction, stiffness_n_m, damping_n_s_m
        link = list(self.foot_links)[leg]
        self.bullet.changeDynamics(self.robot, link, lateralFriction=friction)
        self.bullet.changeDynamics(
            self.robot, link, contactStiffness=stiffness_n_m, contactDamping=damping_n_s_m
        )

    @property
    def friction_under_feet(self) -> Array:
        """Friction coefficient of the ground under each foot now, (4,)."""
        return self._footing[:, 0].copy()

    def set_friction(self, friction: float) -> None:
        """The ground's friction coefficient where the robot lies on it or leans against it: of all
        links that are no feet.
        """
        self._put_friction(friction)
        touch = (self.bullet.getContactPoints(self.robot, self.ground, k) for k in self._others)
        if self._endless and any(touch):
            # Its points of contact keep the friction with which they began: they begin anew.
            for depth_m in (APART_M, 0.0):
                pose = self._ground_pose(depth_m)
                self.bullet.resetBasePositionAndOrientation(self.ground, *pose)
                self.bullet.performCollisionDetection()

    def _put_friction(self, friction: float) -> None:
        self._friction = friction
        for link in self._others:
            self.bullet.changeDynamics(self.robot, link, lateralFriction=friction)

    def sink_ground(self, leg: int, depth_m: float) -> None:
        """Put the ground under one foot `depth_m` below the surface (an engine with `sinking`)."""
        self._sunk_m[leg] = depth_m
        pose = self._ground_pose(depth_m)
        self.bullet.resetBasePositionAndOrientation(self._foot_grounds[leg], *pose)

    # ---- state -----------------------------------------------------------------------------------

    def reset(self, position_m: Array, rotation_body_to_world: Array, joints: Array) -> None:
        """Put the robot at rest: origin of `body` (3) and rotation (3, 3) in the world, joint
        positions (12).
        """
        com = position_m + rotation_body_to_world @ self.base_inertial_m
        turned = rotation_body_to_world @ matrix(self.base_turn)
        self.bullet.resetBasePositionAndOrientation(
            self.robot, com.tolist(), quaternion(turned).tolist()
        )
        self._centre = com.tolist()
        self.bullet.resetBaseVelocity(self.robot, [0, 0, 0], [0, 0, 0])
        for joint, value in zip(self.joints, joints, strict=True):
            self.bullet.resetJointState(self.robot, joint, float(value), 0.0)

    def state(self) -> dict[str, NDArray[Any]]:
        """All that the next steps depend on: bodies and contacts as the engine writes them, and
        what was set since.
        """
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "state.bullet"
            self.bullet.saveBullet(str(file))
            bodies = np.frombuffer(file.read_bytes(), dtype=np.uint8)
        store = self.bullet.getDynamicsInfo(self.robot, self._store)
        return {
            "bodies": bodies,
            "centre": np.array(self._centre, dtype=np.float64),
            "store": np.array([store[0], *store[2]]),
            "friction": np.array([self._friction]),
            "footing": self._footing.copy(),
            "sunk_m": self._sunk_m.copy(),
        }

    def put_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Take over what `state` of an engine with the same bodies gave: its steps go on from
        there, bit for bit.

        Raises InputError where the engine cannot read it.
        """
        mass, *inertia = (float(value) for value in state["store"])
        self.bullet.changeDynamics(self.robot, self._store, mass=mass)
        self.bullet.changeDynamics(self.robot, self._store, localInertiaDiagonal=inertia)
        self._put_friction(float(state["friction"][0]))
        for leg, (friction, stiffness, damping) in enumerate(state["footing"].tolist()):
            self.set_footing(leg, friction, stiffness, damping)
            if self._foot_grounds:
                self.sink_ground(leg, float(state["sunk_m"][leg]))
        with tempfile.TemporaryDirectory() as folder, quiet():
            file = Path(folder) / "state.bullet"
            file.write_bytes(np.asarray(state["bodies"], dtype=np.uint8).tobytes())
            try:
                self.bullet.restoreState(fileName=str(file))
            except p.error as error:
                raise InputError("the engine cannot read these bodies", field="state") from error
        self._centre = tuple(state["centre"].tolist())

    def read(self, state: NDArray[Any]) -> None:
        """Fill `state` (an array of one EngineState of board.py): joints, their rates, pose of the
        principal axes.
        """
        joints = self._joint_states(self.robot, self.joints)
        position, orientation = self._base_pose(self.robot)
        self._centre = position
        if state is not self._state:
            self._state, self._pack = state, _packer(state)
        angles, rates = [joint[0] for joint in joints], [joint[1] for joint in joints]
        self._pack(*angles, *rates, *position, *orientation)

    def hold_with_motors(self, joints: Array) -> None:
        """Give the joints back to the engine's own position motors and limits (the bare reference
        of the benchmark).
        """
        for joint, (low, high) in zip(self.joints, self._limits, strict=True):
            self.bullet.changeDynamics(self.robot, joint, jointLowerLimit=low, jointUpperLimit=high)
        self.bullet.setJointMotorControlArray(
            self.robot, self.joints, p.POSITION_CONTROL, targetPositions=joints.tolist()
        )

    def apply(self, given: NDArray[Any]) -> None:
        """What acts during the next step: an array of one EngineInput of board.py.

        The force acts at the base's centre of mass as `read` (or `reset`) last saw it.
        """
        if given is not self._given:
            names = ("joint_torque", "force", "torque")
            self._given, self._given_parts = given, tuple(given[name][0] for name in names)
        joint_torque, force, torque = self._given_parts
        self._drive_joints(self.robot, self.joints, p.TORQUE_CONTROL, forces=joint_torque.tolist())
        self._push(self.robot, -1, force.tolist(), self._centre, p.WORLD_FRAME)
        self._turn(self.robot, -1, torque.tolist(), p.WORLD_FRAME)

    def step(self) -> None:
        """One step of the bodies and contacts."""
        self._advance()

    def add_store_mass(self, mass_kg: float) -> None:
        """Change the rod store's mass by `mass_kg`; its radius of gyration stays. Raises InputError
        below zero.
        """
        old = self.bullet.getDynamicsInfo(self.robot, self._store)
        if old[0] + mass_kg <= 0:
            raise InputError(
                "takes more mass off the rod store than it has", field="mass_kg", value=mass_kg
            )
        scale = (old[0] + mass_kg) / old[0]
        inertia = [scale * v for v in old[2]]
        self.bullet.changeDynamics(self.robot, self._store, mass=old[0] + mass_kg)
        self.bullet.changeDynamics(self.robot, self._store, localInertiaDiagonal=inertia)

    def add_link_mass(self, axis: int, mass_kg: float) -> None:
        """Change the mass of what an axis (0..11) moves by `mass_kg`, at its centre of mass."""
        if mass_kg == 0.0:
            return
        link = self.joints[axis]
        old = self.bullet.getDynamicsInfo(self.robot, link)[0]
        self.bullet.changeDynamics(self.robot, link, mass=old + mass_kg)

    def masses(self) -> Array:
        """Masses of base and links, kg."""
        count = self.bullet.getNumJoints(self.robot)
        return np.array(
            [self.bullet.getDynamicsInfo(self.robot, index)[0] for index in range(-1, count)]
        )

    def close(self) -> None:
        """Give the client back; so does the end of the engine's life or of the process."""
        self._given_back()


def _disconnect(client: BulletClient) -> None:
    with contextlib.suppress(p.error):
        client.disconnect()


def _packer(state: NDArray[Any]) -> Callable[..., None]:
    """Writes joints, rates, position and quaternion into this array of one record, wherever it has
    them.
    """
    form, at = "=", 0
    for name in ("joint", "joint_rate", "position", "quaternion"):
        kind, offset = state.dtype.fields[name][:2]  # type: ignore[index]
        form += f"{offset - at}x{kind.itemsize // 8}d"
        at = offset + kind.itemsize
    return partial(Struct(form).pack_into, state.view(np.uint8).data, 0)


def matrix(quaternion_xyzw: Any) -> Array:
    """Rotation matrix (3, 3) of a quaternion xyzw."""
    return np.array(p.getMatrixFromQuaternion(quaternion_xyzw), dtype=np.float64).reshape(3, 3)
