"""The compiled equations of motion of the legs against Pinocchio's."""

from __future__ import annotations

import numpy as np
from shipped import shipped_model

from testbed.machine.names import LEGS
from testbed.robot.loads import foot_forces as ff
from testbed.robot.model import attitude_gravity

MODEL = shipped_model()


def test_leg_masses_and_the_base_add_up_to_the_machine() -> None:
    legs = MODEL.leg_numbers()
    assert legs["links"]["mass"].sum() + MODEL.base_mass()[0] == np.float64(4000.0)


def test_foot_forces_balance_pinocchios_inverse_dynamics_in_any_motion() -> None:
    rng = np.random.default_rng(3)
    legs, identity = MODEL.leg_numbers(), np.eye(3)
    for _ in range(20):
        low, high = MODEL.limits.T
        q = rng.uniform(low, high)
        qd, qdd = rng.normal(0.0, 0.2, 12), rng.normal(0.0, 1.0, 12)
        w, alpha = rng.normal(0.0, 0.3, 3), rng.normal(0.0, 1.0, 3)
        velocity, change = rng.normal(0.0, 0.3, 3), rng.normal(0.0, 1.0, 3)
        gravity = attitude_gravity(*rng.uniform(-0.5, 0.5, 2))
        needed = MODEL.inverse_dynamics(
            q, np.r_[velocity, w, qd], np.r_[change, alpha, qdd], gravity
        )
        force = rng.normal(0.0, 3000.0, (4, 3))
        _, jacobians = MODEL.feet(q)
        torque = needed[6:] - np.einsum("ki,kij->j", force, jacobians)
        lift = change + np.cross(w, velocity) - gravity
        found, normal = np.zeros((4, 3)), np.zeros(4)
        joints, body = ff.JointMotion.zeros()[0], ff.BodyMotion.zeros()[0]
        joints["position"], joints["rate"] = q, qd
        joints["acceleration"], joints["torque"] = qdd, torque
        body["angular_velocity"], body["angular_acceleration"], body["lift"] = w, alpha, lift
        normals = np.tile(identity[2], (4, 1))
        ff.foot_forces(legs, joints, identity, body, normals, found, normal)
        np.testing.assert_allclose(found, force, atol=1e-6)
        np.testing.assert_allclose(normal, force[:, 2], atol=1e-6)
    assert len(LEGS) == 4
