"""The own estimator: its geometry against Pinocchio's, its balance against the statics, what it learns from what."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shipped import shipped_model

from testbed.estimation.live import axis_kernel as ax
from testbed.estimation.live import fusion_kernel as fu
from testbed.estimation.live import own_kernel as own
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.body_belief import OwnTuning, packed, without
from testbed.estimation.live.chain import EstimatorChain
from testbed.machine.build import build_machine
from testbed.machine.names import LEGS
from testbed.recording.rows import DrillKnown
from testbed.robot.linkage import RotationLinkage
from testbed.robot.loads.drill_loads import known_wrench
from testbed.robot.loads.foot_loads import ExpectedLoads, point_wrench
from testbed.robot.model import attitude_gravity

MODEL, MACHINE = shipped_model(), build_machine()
LINKAGE = RotationLinkage.from_machine(MACHINE)
BELIEF = Believed.from_machine(MACHINE, 1e-3)
LEVEL = attitude_gravity(0.0, 0.0)
STANCE = np.tile([0.1, 0.2, 0.25], 4)
AREA_A, AREA_B = BELIEF.legs[0].area_a_m2, BELIEF.legs[0].area_b_m2


def body(tuning: OwnTuning | None = None) -> np.ndarray:
    return packed(MACHINE, MODEL, BELIEF.legs, 1e-3, np.zeros((2, 3)), tuning)


def arms(q: np.ndarray) -> np.ndarray:
    out = np.ones(12)
    out[::3] = LINKAGE.moment_arm_m(q[::3])
    return out


def standing(
    lies: dict[int, float] | None = None, vertical_b_pa: float = 2e6
) -> tuple[np.ndarray, np.ndarray]:
    """Pressures (12,) with which the machine stands still without friction; `lies`: axis -> N that its sensors add."""
    loads = ExpectedLoads(MODEL, MACHINE).solve(STANCE, LEVEL, joint_compliance=np.zeros(12))
    _, jacobians = MODEL.feet(STANCE)
    torque = MODEL.gravity_forces(STANCE, LEVEL)[6:] - np.einsum(
        "ki,kij->j", loads.force_in_body_n, jacobians
    )
    force = torque / arms(STANCE)
    pa, pb = np.empty(12), np.full(12, vertical_b_pa)
    beliefs = body()[own.AXES_AT :].reshape(12, ax.AXIS_BELIEFS)
    for i in range(12):
        force[i] += (lies or {}).get(i, 0.0)
        pa[i] = (force[i] + pb[i] * beliefs[i, ax.AREA_B]) / beliefs[i, ax.AREA_A]
    return pa, pb


def settled(
    tuning: OwnTuning, lies: dict[int, float] | None = None, steps: int = 4000
) -> EstimatorChain:
    chain = EstimatorChain(replace(BELIEF, body=body(tuning)))
    pa, pb = standing(lies)
    inertial = np.r_[np.zeros(3), -LEVEL]
    for _ in range(steps):
        chain.step(pa, pb, STANCE, LEVEL, np.zeros(12), 40.0, inertial=inertial)
    return chain


def test_map_from_cylinders_to_foot_is_the_inverse_of_pinocchios_jacobian() -> None:
    rng = np.random.default_rng(1)
    legs = MODEL.leg_numbers()
    for _ in range(10):
        q = rng.uniform(*MODEL.limits.T)
        _, jacobians = MODEL.feet(q)
        for k in range(4):
            found = np.empty((3, 3))
            own.leg_map(legs[k], q[3 * k : 3 * k + 3], arms(q)[3 * k], found)
            # tau = -J^T F, cylinder forces f = tau / arm
            j = jacobians[k][:, 3 * k : 3 * k + 3]
            expected = -np.linalg.inv(j.T) @ np.diag(arms(q)[3 * k : 3 * k + 3])
            np.testing.assert_allclose(found, expected, atol=1e-9)


def test_feet_stand_where_pinocchio_has_them() -> None:
    q = np.random.default_rng(2).uniform(*MODEL.limits.T)
    numbers, legs, point = body(), MODEL.leg_numbers(), np.empty(3)
    for k in range(4):
        own.foot_point(legs[k], q[3 * k : 3 * k + 3], numbers[own.FOOT_Z + k], point)
        np.testing.assert_allclose(point, MODEL.foot_positions_m(q)[k], atol=1e-12)


def test_weight_ropes_and_drill_make_the_wrench_of_the_statics() -> None:
    q = np.random.default_rng(3).uniform(*MODEL.limits.T)
    gravity = attitude_gravity(0.05, -0.6)
    ropes = np.array([[0.98, 0.17, 0.1], [0.98, -0.17, 0.1]])
    ropes /= np.linalg.norm(ropes, axis=1)[:, None]
    numbers = packed(MACHINE, MODEL, BELIEF.legs, 1e-3, ropes)
    drill = np.array([5e3, -300.0, 40.0, 20.0, 1.5, -60.0])
    found = own.other_wrench(
        q, gravity, -gravity, np.zeros(3), np.array([9e3, 8e3]), np.eye(3), drill, numbers
    )
    expected = -MODEL.gravity_forces(q, gravity)[:6]
    for k, tension in enumerate((9e3, 8e3)):
        expected += point_wrench(tension * ropes[k], MODEL.rope_attachments_m[k])
    expected += known_wrench(MODEL, np.array([tuple(drill)], DrillKnown.dtype)[0], gravity)
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_a_still_machine_is_read_as_the_statics_have_it() -> None:
    chain = settled(OwnTuning())
    true = (
        ExpectedLoads(MODEL, MACHINE)
        .solve(STANCE, LEVEL, joint_compliance=np.zeros(12))
        .force_in_body_n
    )
    for r, name in enumerate(("own_x", "own_y", "own_z")):
        # the middle of friction's set is not 0: what is left is inside its standard deviation
        off = np.abs(chain.method(name) - true[:, r])
        assert (off < 1.5 * chain.method(f"{name}_sd")).all() and off.max() < 150.0


def test_a_sensor_that_lies_beyond_what_friction_can_hide_carries_the_blame_alone() -> None:
    lie = {LEGS.index("fl") * 3 + 2: 4000.0}
    true = settled(OwnTuning()).method("own").copy()
    alone = settled(without(OwnTuning(), "balance"), lie).method("own") - true
    fused = settled(OwnTuning(), lie, steps=20_000).method("own") - true
    stiff = settled(without(OwnTuning(), "robust"), lie, steps=20_000).method("own") - true
    assert alone[0] > 3500.0
    assert np.abs(fused).max() < 500.0
    assert np.abs(fused).max() < 0.7 * np.abs(stiff).max()


def test_a_foot_that_moves_both_ways_in_the_air_tells_the_zero_from_friction() -> None:
    """A zero of 150 N, and friction 30 N more than believed, against the motion."""
    x, p = np.zeros(fu.N), np.zeros((fu.N, fu.N))
    fu.start(x, p, np.full(12, 200.0), np.full(12, 50.0), np.full(6, 200.0))
    h = np.zeros(fu.N)
    h[fu.Z + 2] = h[fu.D + 2] = 1.0
    for _ in range(50):  # extending: friction 30 N more than believed; then retracting: 30 N less
        fu.observe(x, p, h, 180.0, 400.0, 1e9)
    fresh = np.ones(12)
    fresh[2] = 0.0  # the piston has turned: what friction deviated by is forgotten, the zero stays
    fu.predict(
        x,
        p,
        fresh,
        np.full(12, 50.0),
        np.zeros(12),
        np.full(12, 200.0),
        np.zeros(12),
        np.full(6, 200.0),
        1.0,
        0.01,
        0.0,
    )
    for _ in range(50):
        fu.observe(x, p, h, 120.0, 400.0, 1e9)
    assert x[fu.Z + 2] == pytest.approx(150.0, abs=15.0)
    assert np.sqrt(p[fu.Z + 2, fu.Z + 2]) < 45.0


def test_one_observation_is_the_textbook_kalman_update() -> None:
    x, p = np.zeros(fu.N), np.zeros((fu.N, fu.N))
    fu.start(x, p, np.full(12, 3.0), np.full(12, 4.0), np.ones(6))
    h = np.zeros(fu.N)
    h[0] = h[12] = 1.0  # z and d of one axis: variances 9 and 16, noise 25: gain 9 / 50 and 16 / 50
    fu.observe(x, p, h, 10.0, 25.0, 1e9)
    assert x[0] == pytest.approx(1.8) and x[12] == pytest.approx(3.2)
    assert p[0, 0] == pytest.approx(9.0 - 81.0 / 50.0) and p[0, 12] == pytest.approx(
        -9.0 * 16.0 / 50.0
    )


def test_a_missing_sample_is_bridged_and_teaches_nothing() -> None:
    chain = settled(OwnTuning(), steps=500)
    before = chain.method("own").copy()
    pa, pb = standing()
    pa[2] = np.nan
    for _ in range(7):
        chain.step(pa, pb, STANCE, LEVEL, np.zeros(12), 40.0, inertial=np.r_[np.zeros(3), -LEVEL])
    names = (
        "own",
        "own_low",
        "own_high",
        "own_sd",
        "own_x",
        "own_y",
        "own_z",
        "own_x_sd",
        "own_y_sd",
        "own_z_sd",
    )
    assert all(np.isfinite(chain.method(name)).all() for name in names)
    assert np.abs(chain.method("own") - before).max() < 30.0


def test_four_legs_take_less_than_thirty_microseconds_a_step() -> None:
    import time

    chain = settled(OwnTuning(), steps=10)
    pa, pb = standing()
    quickest = np.inf
    for _ in range(5):
        began = time.thread_time()
        for _ in range(400):
            chain.step(pa, pb, STANCE, LEVEL, np.zeros(12), 40.0, inertial=np.zeros(6))
        quickest = min(quickest, (time.thread_time() - began) / 400)
    assert quickest < 30e-6
