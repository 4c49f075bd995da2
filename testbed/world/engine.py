"""The bodies and their contacts: the one file that speaks to PyBullet."""

from __future__ import annotations

import contextlib
import ctypes
import math
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError, SimulationFault
from testbed.parameters.names import AXES, GRAVITY_M_S2, LEGS
from testbed.robot import foot_forces as ff
from testbed.robot.urdf_check import read_urdf
from testbed.robot.urdf_merge import merged
from testbed.world.rock import rock_texture
from testbed.world.rotations import quaternion
from testbed.world.terrain import Ground

Array = NDArray[np.float64]
_MASTER = os.environ.get("TESTBED_ENGINE_MESSAGES")


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep the engine's messages off the console while it loads a file (it prints from C)."""
    if _MASTER:
        yield
        return
    flush = ctypes.CDLL(None).fflush
    sys.stdout.flush()
    sys.stderr.flush()
    flush(None)
    saved, null = [os.dup(1), os.dup(2)], os.open(os.devnull, os.O_WRONLY)
    try:
        for stream in (1, 2):
            os.dup2(null, stream)
        yield
    finally:
        flush(None)
        for stream, old in zip((1, 2), saved, strict=True):
            os.dup2(old, stream)
            os.close(old)
        os.close(null)


with _quiet():
    import pybullet as p


class Engine:
    """One engine client with the robot and its ground.

    Poses and forces are in the world frame (z up). The robot's base pose refers to the **origin of the link
    `body`**, not to the centre of mass that the engine speaks of. Joints are free: what holds them are the torques
    handed in at every step; friction and end stops belong to the hydraulics.
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
    ) -> None:
        self.client = p.connect(p.GUI if gui else p.DIRECT)
        if self.client < 0:
            raise SimulationFault("the physics engine gave no client")
        self._dressed = False
        self._centre: Sequence[float] = (0.0, 0.0, 0.0)
        c = self.client
        p.setGravity(0, 0, -GRAVITY_M_S2, physicsClientId=c)
        p.setPhysicsEngineParameter(
            fixedTimeStep=step_s, numSolverIterations=iterations, numSubSteps=0, physicsClientId=c
        )
        if robot_first:
            self._load_robot(urdf)
            self._load_ground(ground)
        else:
            self._load_ground(ground)
            self._load_robot(urdf)
        self._set_dynamics(ground)

    # ---- loading -------------------------------------------------------------------------------------------

    def _load_robot(self, urdf: Path) -> None:
        try:
            with _quiet(), tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
                # The engine's own welding of fixed links would lose products of inertia.
                file.write(merged(read_urdf(urdf), keep=("rod_store",)))
                file.flush()
                self.robot = p.loadURDF(file.name, flags=p.URDF_USE_INERTIA_FROM_FILE, physicsClientId=self.client)
        except p.error as error:
            raise InputError("the engine cannot load this URDF", file=urdf) from error
        info = [
            p.getJointInfo(self.robot, i, physicsClientId=self.client)
            for i in range(p.getNumJoints(self.robot, physicsClientId=self.client))
        ]
        by_name = {row[1].decode(): row[0] for row in info}
        missing = [name for name in AXES if name not in by_name]
        if missing:
            raise InputError("lacks a joint", file=urdf, field=missing[0], allowed=", ".join(AXES))
        self.joints: list[int] = [by_name[name] for name in AXES]
        self._limits = [(info[joint][8], info[joint][9]) for joint in self.joints]
        links = {row[12].decode(): row[0] for row in info}
        if "rod_store" not in links:
            raise InputError("lacks a link", file=urdf, field="rod_store")
        self.foot_links: dict[int, int] = {by_name[f"{leg}_vertical"]: k for k, leg in enumerate(LEGS)}
        self._store = links["rod_store"]
        dyn = p.getDynamicsInfo(self.robot, -1, physicsClientId=self.client)
        self.base_inertial_m = np.array(dyn[3])
        self.base_turn = np.array(dyn[4])
        """Quaternion xyzw of the base's principal axes in the body frame: what the engine calls its orientation."""

    def _load_ground(self, g: Ground) -> None:
        c = self.client
        if g.kind == "plane":
            shape = p.createCollisionShape(p.GEOM_PLANE, physicsClientId=c)
        elif g.kind == "box":
            shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[100, 100, 1], physicsClientId=c)
        else:
            assert g.heights_m is not None
            rows, columns = g.heights_m.shape
            shape = p.createCollisionShape(
                p.GEOM_HEIGHTFIELD,
                meshScale=[g.cell_m, g.cell_m, 1.0],
                heightfieldData=g.heights_m.T.ravel().tolist(),
                numHeightfieldRows=rows,
                numHeightfieldColumns=columns,
                physicsClientId=c,
            )
        offset, rotation = g.engine_pose()
        self.ground = p.createMultiBody(0, shape, physicsClientId=c)
        p.resetBasePositionAndOrientation(self.ground, offset, rotation, physicsClientId=c)

    def _set_dynamics(self, g: Ground) -> None:
        c, links = self.client, [-1, *range(p.getNumJoints(self.robot, physicsClientId=self.client))]
        p.changeDynamics(self.robot, -1, linearDamping=0.0, physicsClientId=c)
        p.changeDynamics(self.robot, -1, angularDamping=0.0, physicsClientId=c)
        for link in links:
            p.changeDynamics(self.robot, link, jointDamping=0.0, physicsClientId=c)
            p.changeDynamics(self.robot, link, lateralFriction=1.0, physicsClientId=c)
            p.changeDynamics(self.robot, link, restitution=0.0, physicsClientId=c)
            p.changeDynamics(self.robot, link, maxJointVelocity=1e4, physicsClientId=c)
            if link >= 0:  # end stops live in the hydraulics; the engine's would push unseen, and keep on at 1, -1
                p.changeDynamics(self.robot, link, jointLowerLimit=-10.0, jointUpperLimit=10.0, physicsClientId=c)
        for link in self.foot_links:
            p.changeDynamics(
                self.robot,
                link,
                contactStiffness=g.stiffness_n_m,
                contactDamping=g.damping_n_s_m,
                physicsClientId=c,
            )
        p.changeDynamics(self.ground, -1, lateralFriction=g.friction, physicsClientId=c)
        p.changeDynamics(self.ground, -1, restitution=0.0, physicsClientId=c)
        p.setJointMotorControlArray(
            self.robot, self.joints, p.VELOCITY_CONTROL, forces=[0.0] * len(self.joints), physicsClientId=c
        )

    # ---- state ---------------------------------------------------------------------------------------------

    def reset(self, position_m: Array, rotation_body_to_world: Array, joints: Array) -> None:
        """Put the robot at rest: origin of `body` (3) and rotation (3, 3) in the world, joint positions (12)."""
        com = position_m + rotation_body_to_world @ self.base_inertial_m
        turned = rotation_body_to_world @ matrix(self.base_turn)
        p.resetBasePositionAndOrientation(
            self.robot, com.tolist(), quaternion(turned).tolist(), physicsClientId=self.client
        )
        self._centre = com.tolist()
        p.resetBaseVelocity(self.robot, [0, 0, 0], [0, 0, 0], physicsClientId=self.client)
        for joint, value in zip(self.joints, joints, strict=True):
            p.resetJointState(self.robot, joint, float(value), 0.0, physicsClientId=self.client)

    def read(self, state: Array) -> None:
        """Fill `state` (31): joint positions (12), rates (12), position and quaternion of the base's principal axes."""
        angles, rates, _, _ = zip(*p.getJointStates(self.robot, self.joints, self.client), strict=True)
        position, orientation = p.getBasePositionAndOrientation(self.robot, self.client)
        self._centre = position
        state[:] = angles + rates + position + orientation

    def leg_numbers(self) -> Array:
        """What foot_forces.py needs of each leg (4, LEG_COLUMNS), read off the engine's own bodies with joints at 0."""
        c = self.client
        joints = [s[0] for s in p.getJointStates(self.robot, self.joints, c)]
        for joint in self.joints:
            p.resetJointState(self.robot, joint, 0.0, 0.0, physicsClientId=c)
        position, orientation = p.getBasePositionAndOrientation(self.robot, c)
        turn = matrix(orientation) @ matrix(self.base_turn).T
        out = np.zeros((4, ff.LEG_COLUMNS))
        for leg in range(4):
            links = self.joints[3 * leg : 3 * leg + 3]
            states = p.getLinkStates(self.robot, links, computeForwardKinematics=True, physicsClientId=c)
            hip = turn.T @ (np.array(states[0][4]) - position)
            frame = turn.T @ matrix(states[0][5])
            row = out[leg]
            row[ff.HIP : ff.HIP + 3] = hip
            row[ff.YAW] = math.atan2(frame[1, 0], frame[0, 0])
            row[ff.RADIAL : ff.RADIAL + 3] = frame @ np.array(p.getJointInfo(self.robot, links[1], c)[13])
            for i, (link, state) in enumerate(zip(links, states, strict=True)):
                dyn = p.getDynamicsInfo(self.robot, link, physicsClientId=c)
                row[ff.CENTRES + 3 * i : ff.CENTRES + 3 * i + 3] = turn.T @ (np.array(state[0]) - position) - hip
                row[ff.MASSES + i] = dyn[0]
                row[ff.INERTIAS + 3 * i : ff.INERTIAS + 3 * i + 3] = dyn[2]
            row[ff.FOOT : ff.FOOT + 2] = (turn.T @ (np.array(states[2][4]) - position) - hip)[:2]
        for joint, value in zip(self.joints, joints, strict=True):
            p.resetJointState(self.robot, joint, value, 0.0, physicsClientId=c)
        return out

    def hold_with_motors(self, joints: Array) -> None:
        """Give the joints back to the engine's own position motors and limits (the bare reference of the benchmark)."""
        c = self.client
        for joint, (low, high) in zip(self.joints, self._limits, strict=True):
            p.changeDynamics(self.robot, joint, jointLowerLimit=low, jointUpperLimit=high, physicsClientId=c)
        p.setJointMotorControlArray(
            self.robot, self.joints, p.POSITION_CONTROL, targetPositions=joints.tolist(), physicsClientId=c
        )

    def apply(self, given: Array) -> None:
        """What acts during the next step (18): joint torques (12), force (3) and torque (3) on the base, world frame.

        The force acts at the base's centre of mass as `read` (or `reset`) last saw it.
        """
        c, values = self.client, given.tolist()
        p.setJointMotorControlArray(self.robot, self.joints, p.TORQUE_CONTROL, forces=values[:12], physicsClientId=c)
        p.applyExternalForce(self.robot, -1, values[12:15], self._centre, p.WORLD_FRAME, c)
        p.applyExternalTorque(self.robot, -1, values[15:], p.WORLD_FRAME, c)

    def step(self) -> None:
        """One step of the bodies and contacts."""
        p.stepSimulation(self.client)

    def contacts(self, foot_force: Array, normal_force: Array) -> float:
        """Sum contacts per foot: force of the ground on the foot (4, 3), world frame, and its normal part (4), N.

        Returns the normal force on everything else of the robot (belly), N.
        """
        foot_force[:] = 0.0
        normal_force[:] = 0.0
        elsewhere = 0.0
        # Asked for one body's contacts the engine turns the normal round where that body is second, but not the
        # friction. So all contacts are fetched as they are, and turned here as a whole.
        for row in p.getContactPoints(physicsClientId=self.client):
            n = row[9]
            if n == 0.0:
                continue
            first = row[1] == self.robot
            foot = self.foot_links.get(row[3] if first else row[4])
            if foot is None:
                elsewhere += n
                continue
            sign = 1.0 if first else -1.0
            n, f1, f2 = sign * n, sign * row[10], sign * row[12]
            (nx, ny, nz), (ax, ay, az), (bx, by, bz) = row[7], row[11], row[13]
            total = foot_force[foot]
            total[0] += n * nx + f1 * ax + f2 * bx
            total[1] += n * ny + f1 * ay + f2 * by
            total[2] += n * nz + f1 * az + f2 * bz
            normal_force[foot] += abs(n)
        return elsewhere

    def ground_distance(self, start: Array, direction: Array, reach_m: float = 5.0) -> float:
        """Distance from `start` (3) along the unit vector `direction` (3) to the ground, m; nan if there is none."""
        end = start + reach_m * direction
        for hit in p.rayTest(start.tolist(), end.tolist(), physicsClientId=self.client):
            if hit[0] == self.ground:
                return float(hit[2] * reach_m)
        return math.nan

    def add_store_mass(self, mass_kg: float) -> None:
        """Change the rod store's mass by `mass_kg`; its radius of gyration stays. Raises InputError below zero."""
        old = p.getDynamicsInfo(self.robot, self._store, physicsClientId=self.client)
        if old[0] + mass_kg <= 0:
            raise InputError("takes more mass off the rod store than it has", field="mass_kg", value=mass_kg)
        scale = (old[0] + mass_kg) / old[0]
        inertia = [scale * v for v in old[2]]
        p.changeDynamics(self.robot, self._store, mass=old[0] + mass_kg, physicsClientId=self.client)
        p.changeDynamics(self.robot, self._store, localInertiaDiagonal=inertia, physicsClientId=self.client)

    def add_leg_mass(self, leg: int, mass_kg: float) -> None:
        """Change the mass of a leg's sliding frame (leg 0..3) by `mass_kg`; it moves along with the joint only."""
        link = self.joints[3 * leg + 2]
        old = p.getDynamicsInfo(self.robot, link, physicsClientId=self.client)[0]
        p.changeDynamics(self.robot, link, mass=old + mass_kg, physicsClientId=self.client)

    def masses(self) -> Array:
        """Masses of base and links, kg."""
        count = p.getNumJoints(self.robot, physicsClientId=self.client)
        return np.array([p.getDynamicsInfo(self.robot, i, physicsClientId=self.client)[0] for i in range(-1, count)])

    def link_position(self, link: int) -> Array:
        """Centre of mass (3) of a link in the world, m; -1 is the base."""
        if link < 0:
            return np.array(p.getBasePositionAndOrientation(self.robot, self.client)[0])
        return np.array(p.getLinkState(self.robot, link, physicsClientId=self.client)[0])

    def momentum(self) -> tuple[Array, Array]:
        """Linear momentum (3), N s, and angular momentum about the world's origin (3), N m s, of the whole robot."""
        c = self.client
        linear, angular = np.zeros(3), np.zeros(3)
        count = p.getNumJoints(self.robot, physicsClientId=c)
        for i in range(-1, count):
            info = p.getDynamicsInfo(self.robot, i, physicsClientId=c)
            mass, inertia = info[0], np.diag(info[2])
            if i < 0:
                position, orientation = p.getBasePositionAndOrientation(self.robot, c)
                v, w = p.getBaseVelocity(self.robot, c)
            else:
                state = p.getLinkState(self.robot, i, 1, 1, physicsClientId=c)
                position, orientation, v, w = state[0], state[1], state[6], state[7]
            r = np.array(p.getMatrixFromQuaternion(orientation)).reshape(3, 3)
            part = mass * np.array(v)
            linear += part
            angular += np.cross(position, part) + r @ inertia @ r.T @ np.array(w)
        return linear, angular

    # ---- pictures ------------------------------------------------------------------------------------------

    def picture(self, eye: Sequence[float], target: Sequence[float], width: int, height: int) -> NDArray[np.uint8]:
        """A picture (height, width, 3) of the scene from `eye` towards `target` (world, m)."""
        self._dress_ground()
        view = p.computeViewMatrix(eye, target, [0, 0, 1])
        projection = p.computeProjectionMatrixFOV(38.0, width / height, 0.1, 200.0)
        image = p.getCameraImage(
            width,
            height,
            view,
            projection,
            lightDirection=[-4, -6, 10],
            shadow=int(width >= 600),  # a shadow costs three times the picture
            renderer=p.ER_TINY_RENDERER,
            physicsClientId=self.client,
        )
        colours = np.asarray(image[2], dtype=np.uint8).reshape(height, width, 4)[:, :, :3].copy()
        nothing = np.asarray(image[4]).reshape(height, width) < 0
        sky = np.linspace([176.0, 203.0, 230.0], [232.0, 238.0, 243.0], height).astype(np.uint8)
        colours[nothing] = np.broadcast_to(sky[:, None, :], colours.shape)[nothing]
        return colours

    def _dress_ground(self) -> None:
        """Rock instead of the engine's chequered floor; once, and only where somebody looks."""
        if self._dressed:
            return
        self._dressed = True
        from PIL import Image

        with tempfile.NamedTemporaryFile(suffix=".png") as file, _quiet():
            Image.fromarray(rock_texture()).save(file.name)
            texture = p.loadTexture(file.name, physicsClientId=self.client)
        p.changeVisualShape(self.ground, -1, textureUniqueId=texture, physicsClientId=self.client)
        p.changeVisualShape(self.ground, -1, rgbaColor=[1, 1, 1, 1], physicsClientId=self.client)

    def add_line(self, start: Array, end: Array, radius_m: float, colour: Sequence[float]) -> int:
        """A thin cylinder to look at (a rope, a rod); no collision. Returns its id for `remove`."""
        axis = end - start
        length = float(np.linalg.norm(axis))
        shape = p.createVisualShape(
            p.GEOM_CYLINDER, radius=radius_m, length=length, rgbaColor=colour, physicsClientId=self.client
        )
        z = axis / length
        x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [1.0, 0.0, 0.0], z)
        x /= np.linalg.norm(x)
        rotation = np.column_stack([x, np.cross(z, x), z])
        return int(
            p.createMultiBody(
                0,
                -1,
                shape,
                ((start + end) / 2).tolist(),
                quaternion(rotation).tolist(),
                physicsClientId=self.client,
            )
        )

    def remove(self, body: int) -> None:
        """Take a body out that `add_line` put in."""
        p.removeBody(body, physicsClientId=self.client)

    def close(self) -> None:
        """Give the client back."""
        if self.client >= 0:
            with contextlib.suppress(p.error):
                p.disconnect(self.client)
            self.client = -1


def matrix(quaternion_xyzw: Any) -> Array:
    """Rotation matrix (3, 3) of a quaternion xyzw."""
    return np.array(p.getMatrixFromQuaternion(quaternion_xyzw), dtype=np.float64).reshape(3, 3)
