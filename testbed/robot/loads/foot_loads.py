"""Expected foot loads: what each foot should carry, from weight, posture, ropes and drill.

Four feet and six equations: on a plane the normal loads have one degree of freedom that equilibrium
leaves open (an
internal force: one diagonal against the other). Compliance and the feet's free heights decide it,
so every answer comes with its sensitivity to height errors. A foot never pulls; friction is
Coulomb's.

Wrenches are force and moment about the body's origin, body frame, N and N m, acting on the machine.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from testbed.formats.arrays import Array
from testbed.machine.model import Machine
from testbed.machine.names import AXES, LEGS, VERTICAL
from testbed.robot.contact.geometry import FootLoads, Ground, Legs, feet_under_load
from testbed.robot.loads.compliance import OilColumns
from testbed.robot.model import Payload, RobotModel


@dataclass(frozen=True)
class Footing:
    """What the feet stand on, if not four patches of the believed ground on one plane; body
    frame.
    """

    in_contact: ArrayLike | None = None
    """(4,), false for a swinging foot."""
    normals_in_body: ArrayLike | None = None
    """(4, 3)."""
    compliance_m_n: ArrayLike | None = None
    """(4, 3, 3), instead of that of joints and ground."""
    heights_m: ArrayLike | None = None
    """(4,): how far the ground under a foot stands proud of the plane through the unloaded feet,
    along the normal.
    """


PLANE = Footing()


def point_wrench(force_in_body: ArrayLike, point_in_body: ArrayLike) -> Array:
    """Wrench (6,) about the body's origin of a force (3,) N at a point (3,) m; both in the body
    frame.
    """
    fx, fy, fz = np.asarray(force_in_body, dtype=float).tolist()
    x, y, z = np.asarray(point_in_body, dtype=float).tolist()
    return np.array([fx, fy, fz, y * fz - z * fy, z * fx - x * fz, x * fy - y * fx])


def drill_wrench(model: RobotModel, thrust_n: float, torque_n_m: float = 0.0) -> Array:
    """Reaction of drilling on the machine (6,): thrust + pushes it away from the slope, torque
    about the drill axis.

    `torque_n_m` is what the rock does to the machine, + about body z.
    """
    wrench = point_wrench([0.0, 0.0, thrust_n], model.drill_mount_m)
    wrench[5] += torque_n_m
    return wrench


def external_wrench(
    model: RobotModel,
    positions: ArrayLike,
    gravity_in_body: ArrayLike,
    payload: Payload | None,
    rope_forces_in_body: ArrayLike | None,
    drill: ArrayLike | None,
) -> Array:
    """Everything that acts on the machine but the feet, (6,): weight, payload, ropes (2, 3) and
    drill wrench (6,).
    """
    load = -model.gravity_forces(positions, gravity_in_body)[:6]
    if payload is not None:
        weight = payload.mass_kg * np.asarray(gravity_in_body, dtype=float)
        load += point_wrench(weight, payload.point_in_body_m)
    if rope_forces_in_body is not None:
        for force, point in zip(
            np.asarray(rope_forces_in_body, dtype=float), model.rope_attachments_m, strict=True
        ):
            load += point_wrench(force, point)
    return load if drill is None else load + np.asarray(drill, dtype=float)


class ExpectedLoads:
    """Solves for the expected foot loads of one machine; a call takes about a tenth of a
    millisecond.
    """

    def __init__(
        self,
        model: RobotModel,
        machine: Machine,
        *,
        friction: float | None = None,
        ground_compliance_m_n: float | None = None,
    ) -> None:
        """Believed friction and ground compliance (m/N, per foot) come from the machine unless
        given.
        """
        self.model = model
        self.friction = float(machine.ground.friction if friction is None else friction)
        nominal = 1.0 / machine.ground.stiffness_n_m
        self.ground_compliance_m_n = float(
            nominal if ground_compliance_m_n is None else ground_compliance_m_n
        )
        self.oil = OilColumns(machine)
        self._frictions = np.full(len(LEGS), self.friction)
        self._ground = np.tile(self.ground_compliance_m_n * np.eye(3), (len(LEGS), 1, 1))
        self._push = drill_wrench(model, 1.0)

    def solve(
        self,
        positions: ArrayLike,
        gravity_in_body: ArrayLike,
        *,
        payload: Payload | None = None,
        rope_forces_in_body: ArrayLike | None = None,
        drill_wrench_in_body: ArrayLike | None = None,
        joint_compliance: ArrayLike | None = None,
        footing: Footing = PLANE,
    ) -> FootLoads:
        """Foot loads at joint positions (12,) under gravity (3,) m/s2 in the body frame.

        rope_forces_in_body (2, 3) N at the attachment points; drill_wrench_in_body (6,);
        joint_compliance (12,), default the locked oil columns (zeros: joints held rigidly, or
        positions measured under load). If no equilibrium exists, `balanced` is false and
        `missing_wrench` says what the feet cannot balance.
        """
        model = self.model
        load = external_wrench(
            model, positions, gravity_in_body, payload, rope_forces_in_body, drill_wrench_in_body
        )
        found: FootLoads = feet_under_load(
            load,
            self._centre(positions, payload),
            self._legs(positions, joint_compliance, footing),
            self._ground_under(footing),
            self._push,
        )
        return found

    def _legs(
        self, positions: ArrayLike, joint_compliance: ArrayLike | None, footing: Footing
    ) -> Legs:
        undersides, jacobians = self.model.feet(positions)
        if footing.compliance_m_n is not None:
            compliance = _RIGID
        elif joint_compliance is None:
            compliance = self.oil.joint_compliance(positions)
        else:
            compliance = np.asarray(joint_compliance)
        return Legs(undersides, jacobians, _VERTICAL, self.model.foot_radii_m, compliance)

    def _ground_under(self, footing: Footing) -> Ground:
        return Ground(
            _floats(footing.normals_in_body, _NORMALS),
            _floats(footing.compliance_m_n, self._ground),
            _floats(footing.heights_m, _NOUGHT),
            _ALL if footing.in_contact is None else np.asarray(footing.in_contact, dtype=bool),
            self._frictions,
        )

    def _centre(self, positions: ArrayLike, payload: Payload | None) -> Array:
        centre = self.model.centre_of_mass_m(positions)
        if payload is None:
            return centre
        share = payload.mass_kg / (payload.mass_kg + self.model.total_mass_kg)
        return np.asarray(centre + share * (np.array(payload.point_in_body_m) - centre))


_VERTICAL = np.array(VERTICAL)
_NOUGHT, _ALL = np.zeros(len(LEGS)), np.ones(len(LEGS), dtype=bool)
_RIGID = np.zeros(len(AXES))
_NORMALS = np.tile(np.array([0.0, 0.0, 1.0]), (len(LEGS), 1))


def _floats(given: ArrayLike | None, default: Array) -> Array:
    """`given` as floats, or the default."""
    return default if given is None else np.asarray(given, dtype=float)


def internal_force_of(feet_xy: Array) -> Array:
    """(4,) loads of size 1 on feet (4, 2) that have neither sum nor moment: + on fl and rr, - on fr
    and rl.
    """
    null = np.linalg.svd(np.vstack([np.ones(len(LEGS)), feet_xy.T]))[2][3]
    return np.asarray(null * np.sign(null[0]))
