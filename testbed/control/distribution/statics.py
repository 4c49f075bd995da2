"""The machine's balance as control sees it: feet, ropes and joints as linear maps of the forces to
be shared out.

Unknowns z (14): per foot (LEGS order) the ground's force on it along body z (normal), x, y, N; then
the pulls of the left and right rope, N. All in the body frame, which stands parallel to the slope.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from testbed.control.gait import Measured
from testbed.formats.arrays import Array, Flags
from testbed.machine.model import Machine
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.robot.linkage import Linkages
from testbed.robot.loads.foot_loads import OilColumns, drill_wrench, known_wrench, point_wrench
from testbed.robot.model import RobotModel, attitude_gravity
from testbed.robot.rope_bearings import Bearings, SurveyedRopes

FEET = 3 * len(LEGS)
"""How many of the unknowns are forces on feet: z, x, y of each."""
UNKNOWNS = FEET + len(SIDES)
"""How many unknowns there are."""
NORMALS = slice(0, FEET, 3)
"""Which of them are normal loads."""
ROPES = slice(FEET, UNKNOWNS)
"""Which of them are the ropes' pulls."""
_LEG = np.arange(len(LEGS))
_ORDER = (2, 0, 1)
"""A foot's unknowns are z, x, y."""


POSTURE_STEP = 2.0e-4
"""A posture is worked out anew when a joint has moved by this, rad or m: 0.3 mm at a foot (E)."""


@dataclass(frozen=True)
class Balance:
    """One posture: balance @ z + load = 0; lowest <= joint_map @ z + held <= highest."""

    balance: Array
    """(6, 14) wrench on the body about its origin of unit unknowns."""
    load: Array
    """(6,) wrench of everything else: weight, payload, drill; N, N m."""
    joint_map: Array
    """(12, 14) joint force of unit unknowns, N m or N."""
    held: Array
    """(12,) joint forces that hold the legs themselves."""
    lowest: Array
    highest: Array
    """(12,) what the joints can exert at the supply pressure that is measured, or that the load can
    ask for.
    """
    measured: Array
    """(14,) what the unknowns are now, from pressures, estimates and load pins."""
    stance: Flags
    """(4,) which feet are meant to carry."""
    thrust_map: Array
    """(6,) wrench of a unit thrust of the drill, away from the slope."""
    thrust_n: float
    """What control ordered of the drill, N, + away from the slope; part of `load`."""
    rigid: Array
    """(12, 6) orthonormal foot displacements (z, x, y of each foot) that move the body as a
    whole.
    """
    inner: Array
    """(12, 6) orthonormal foot displacements, or forces, that leave the body alone: the complement
    of `rigid`.
    """
    compliance: Array
    """(12,) of the locked joints with their oil at the measured pressures: rad/(N m), m/N."""
    friction: float
    """Believed coefficient between foot and ground."""
    rope_rating_n: float
    """What a traction device may pull."""
    scale: Scale = ROBOCLIMBER
    """The machine's size, with which bounds grow."""

    @property
    def measured_loads_n(self) -> Array:
        """(4,) normal loads."""
        return self.measured[NORMALS]

    @property
    def measured_pull_n(self) -> Array:
        """(2,)."""
        return self.measured[ROPES]


@dataclass(frozen=True)
class _Posture:
    """What follows from the joints alone; the fields of the same names in Balance."""

    position: Array
    balance: Array
    joint_map: Array
    rigid: Array
    inner: Array
    arms: Array
    legs: Array
    """(4, 3, 3) each leg's own part of joint_map."""


class Statics:
    """Makes a Balance of what is measured. `ropes`: as surveyed at the start, body frame; followed
    as the legs walk.
    """

    def __init__(self, model: RobotModel, machine: Machine, ropes: SurveyedRopes) -> None:
        self.model, self.scale = model, machine.scale
        self._bearings = Bearings(ropes)
        areas = np.array([axis.cylinder.areas_m2 for axis in machine.axes.values()])
        self._area_a, self._area_b = areas.T.copy()
        self._linkages = Linkages.from_machine(machine)
        self._friction, self._rating_n = machine.ground.friction, machine.traction.rating_n
        self._tank_pa = float(machine.power_unit.tank_pressure_pa)
        self._on_demand_pa = (
            machine.power_unit.supply_pressure_pa if machine.power_unit.load_sensing else 0.0
        )
        self._oil = OilColumns(machine)
        self._thrust = drill_wrench(model, 1.0)
        self._posture: _Posture | None = None

    def balance(self, measured: Measured, stance: Flags) -> Balance:
        """The balance now."""
        posture, position = self._posture, measured.position
        if posture is None or np.abs(position - posture.position).max() > POSTURE_STEP:
            posture = self._posture = self._work_out(position.copy(), stance)
        drill = measured.drill
        gravity = attitude_gravity(float(measured.attitude[0]), float(measured.attitude[1]))
        supply_pa = max(measured.supply_pressure, self._on_demand_pa)
        reach = max(supply_pa - self._tank_pa, 0.0) * np.abs(posture.arms)
        held = self.model.gravity_forces(position, gravity)
        return Balance(
            friction=self._friction,
            rope_rating_n=self._rating_n,
            balance=posture.balance,
            load=known_wrench(self.model, drill, gravity) - held[:6],
            joint_map=posture.joint_map,
            held=held[6:],
            lowest=-reach * self._area_b,
            highest=reach * self._area_a,
            measured=self._unknowns(measured, posture, held[6:]),
            stance=stance.copy(),  # compiled code takes arrays that can be written to
            thrust_map=self._thrust,
            thrust_n=float(drill["ordered_thrust"]),
            rigid=posture.rigid,
            inner=posture.inner,
            compliance=self._oil.joint_compliance(
                position, (measured.pressure_a, measured.pressure_b)
            ),
            scale=self.scale,
        )

    def _work_out(self, position: Array, stance: Flags) -> _Posture:
        points, jacobians = self.model.feet(position)
        directions = self._bearings.directions(points, stance.astype(float))
        balance, joint_map = np.zeros((6, UNKNOWNS)), np.zeros((len(AXES), UNKNOWNS))
        balance[:, :FEET] = _maps(points)
        for k, at in enumerate(self.model.rope_attachments_m):
            balance[:, ROPES.start + k] = point_wrench(directions[k], at)
        joint_map[:, :FEET] = -jacobians[:, _ORDER].reshape(FEET, len(AXES)).T
        turned = np.linalg.qr(balance[:, :FEET].T, mode="complete")[0]
        arms = self._linkages.rods(position)[1]
        legs = joint_map[:, :FEET].reshape(len(LEGS), 3, len(LEGS), 3)[_LEG, :, _LEG]
        return _Posture(position, balance, joint_map, turned[:, :6], turned[:, 6:], arms, legs)

    def _unknowns(self, measured: Measured, posture: _Posture, held: Array) -> Array:
        """(14,) foot forces from the cylinders' pressures; along the vertical joints the estimators
        know better.
        """
        unknowns = np.empty(UNKNOWNS)
        unknowns[ROPES] = measured.rope_tension
        joint = (
            measured.pressure_a * self._area_a - measured.pressure_b * self._area_b
        ) * posture.arms
        unknowns[:FEET] = np.linalg.solve(
            posture.legs, (joint - held).reshape(len(LEGS), 3, 1)
        ).ravel()
        unknowns[NORMALS] = measured.load
        return unknowns


def _maps(points: Array) -> Array:
    """(6, 12) wrenches of unit forces z, x, y at points (4, 3)."""
    out = np.zeros((6, FEET))
    x, y, z = points.T
    out[2, 0::3], out[0, 1::3], out[1, 2::3] = 1.0, 1.0, 1.0
    out[3, 0::3], out[4, 0::3] = y, -x
    out[4, 1::3], out[5, 1::3] = z, -y
    out[3, 2::3], out[5, 2::3] = -z, x
    return out
