"""Expected foot loads: what each foot should carry, from weight, posture, ropes and drill.

Four feet and six equations: on a plane the normal loads have one degree of freedom that equilibrium
leaves open (an internal force: one diagonal against the other). Compliance and the feet's free
heights decide it, so every answer comes with its sensitivity to height errors. A foot never pulls;
friction is Coulomb's.

Wrenches are force and moment about the body's origin, body frame, N and N m, acting on the machine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from testbed.formats.arrays import Array

# How much a foot gives: the oil columns of its three cylinders in series with the ground.
#
# A locked cylinder is a spring of the two oil volumes, k = A_A^2 / (V_A / beta + E_A) + A_B^2 /
# (V_B / beta + E_B), V_A = dead + A_A x, V_B = dead + A_B (stroke - x), E the widening of their
# hoses. Through the leg's Jacobian J (3 x 3) its compliance reaches the foot: J diag(1/k) J^T. Use
# it where positions are those of the unloaded cylinders; where positions are measured under load
# they contain the oil's give already, and only the ground (and frame) is left.
from testbed.formats.records import SET
from testbed.laws.oil import ATMOSPHERE_PA, effective_bulk_modulus
from testbed.machine.model import Machine
from testbed.machine.names import AXES, LEGS, VERTICAL
from testbed.robot.contact.geometry import FootLoads, Ground, Legs, feet_under_load
from testbed.robot.linkage import Linkages
from testbed.robot.model import Payload, RobotModel, rotation_from_attitude
from testbed.robot.rope_bearings import Bearings, SurveyedRopes

WORKING_PRESSURE_PA = 4.0e6
"""Gauge pressure at which the oil's modulus is taken: 15 kN on the 70 mm bore (a foot's share with
its load).
"""


class OilColumns:
    """The twelve locked cylinders as springs."""

    def __init__(self, machine: Machine) -> None:
        """Areas and volumes of the twelve cylinders of the machine."""
        self._linkages = Linkages.from_machine(machine)
        cylinders = [axis.cylinder for axis in machine.axes.values()]
        self._area_a = np.array([cylinder.areas_m2[0] for cylinder in cylinders])
        self._area_b = self._area_a - np.array(
            [math.pi / 4 * cylinder.rod_m**2 for cylinder in cylinders]
        )
        self._dead_a = np.array([cylinder.dead_volume_a_m3 for cylinder in cylinders])
        self._dead_b = np.array([cylinder.dead_volume_b_m3 for cylinder in cylinders])
        self._stroke = self._linkages.stroke_m
        oil = machine.oil
        self._hoses = oil.hose_elasticity_m3_pa, oil.hose_elasticity_b_m3_pa
        self._bulk, self._air = oil.bulk_modulus_pa, oil.entrained_air
        self._modulus = self._modulus_pa(WORKING_PRESSURE_PA)

    def _modulus_pa(self, gauge_pa: float) -> float:
        return float(
            effective_bulk_modulus(max(gauge_pa, 0.0) + ATMOSPHERE_PA, self._bulk, self._air)
        )

    def stiffness_n_m(
        self, extensions_m: ArrayLike, pressures_pa: tuple[Array, Array] | None = None
    ) -> Array:
        """Stiffness (12,) of the locked cylinders at extensions (12,), N/m (module docstring).

        pressures_pa: gauge pressures (12,), (12,) of chambers A and B where they are known: oil
        with air in it is softer at low pressure. Without them it is that of WORKING_PRESSURE_PA.
        """
        extensions = np.asarray(extensions_m, dtype=float)
        volume_a = self._dead_a + self._area_a * extensions
        volume_b = self._dead_b + self._area_b * (self._stroke - extensions)
        of_a = of_b = np.asarray(self._modulus)
        if pressures_pa is not None:
            of_a, of_b = (np.array([self._modulus_pa(float(p)) for p in of]) for of in pressures_pa)
        gives_a, gives_b = volume_a / of_a + self._hoses[0], volume_b / of_b + self._hoses[1]
        return np.asarray(self._area_a**2 / gives_a + self._area_b**2 / gives_b)

    def joint_compliance(
        self, positions: ArrayLike, pressures_pa: tuple[Array, Array] | None = None
    ) -> Array:
        """Compliance (12,) of the locked joints at joint positions (12,): rad/(N m) for rotation,
        else m/N.

        pressures_pa: see stiffness_n_m.
        """
        extensions, arms = self._linkages.rods(positions)
        return np.asarray(1.0 / (self.stiffness_n_m(extensions, pressures_pa) * arms**2))


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


# What the drill and its rods do to the machine, as far as its own controls know it.
#
# Controls order the feed and the torque, and count the rods: how many hang in the hole, how many
# stand in the mast, how many are left in the store. A rod on its way from the store to the hole
# moves its weight across the platform, and in the hole a part of that weight lies on the hole's
# wall.


def rods_wrench(model: RobotModel, known: Any, gravity_in_body: ArrayLike) -> Array:
    """Weight of the rods on the machine (6,), body frame, beyond what the store carried at the
    start.

    `known`: a DrillKnown or a row with its fields; gravity (3,) m/s2. The string in the hole hangs
    on the feed by its part along the hole; what stands in the mast, and what the store gains or
    loses, acts with all its weight at its place.
    """
    gravity = np.asarray(gravity_in_body, dtype=float)
    in_hole, in_mast = float(known["rods_in_hole"]), float(known["rods_in_mast"])
    height, stored = float(known["rods_mast_height"]), float(known["rods_stored"])
    if in_hole == 0.0 and in_mast == 0.0 and stored == 0.0:
        return np.zeros(6)
    hanging = drill_wrench(model, in_hole * float(gravity[2]))
    standing = point_wrench(in_mast * gravity, model.drill_mount_m + np.array([0.0, 0.0, height]))
    return hanging + standing + point_wrench(stored * gravity, model.rod_store_m)


def known_wrench(model: RobotModel, known: Any, gravity_in_body: ArrayLike) -> Array:
    """Everything of the drill that controls know of (6,): `known` as in `rods_wrench`, gravity (3,)
    in the body frame.
    """
    ordered = drill_wrench(model, float(known["ordered_thrust"]), float(known["ordered_torque"]))
    return ordered + rods_wrench(model, known, gravity_in_body)


class Expectation:
    """The believed machine's foot loads along the vertical joints, N (4), live and from
    measurements alone: posture from the encoders, attitude, rope tensions and what the drill's
    controls know. `ropes`: as surveyed at the start, world frame; followed as the legs walk.
    """

    def __init__(self, loads: ExpectedLoads, ropes: SurveyedRopes) -> None:
        self._loads = loads
        self.surveyed = ropes
        self._bearings = Bearings(ropes)
        self._rope_forces = np.zeros((2, 3))

    @property
    def rope_directions_in_world(self) -> Array:
        """(2, 3) unit vectors from the traction devices to the anchors, as surveyed at the
        start.
        """
        return self.surveyed.directions

    def loads(
        self,
        position: Array,
        gravity_in_body: Array,
        tension_n: Array,
        attitude_rad: Array,
        drill: Array,
        standing: Array,
    ) -> Array:
        """Loads (4), N: position (12), gravity (3) in body, tensions (2), roll pitch yaw (3), drill
        (KNOWN).

        `standing` (4): 1 for a foot that is meant to carry, 0 for one in the air.
        """
        rotation = rotation_from_attitude(attitude_rad)
        feet = self._loads.model.foot_positions_m(position) @ rotation.T
        directions = self._bearings.directions(feet, standing)
        self._rope_forces[:] = tension_n[:, None] * (directions @ rotation)
        found = self._loads.solve(
            position,
            gravity_in_body,
            rope_forces_in_body=self._rope_forces,
            drill_wrench_in_body=known_wrench(self._loads.model, drill, gravity_in_body),
            footing=Footing(in_contact=standing > SET),
        )
        return np.asarray(found.vertical_load_n)
