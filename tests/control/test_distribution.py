"""Sharing the load out: what is wanted obeys the laws of statics, and the machine brings it
about.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from shipped import MACHINE, shipped_model

from testbed.control.distribution.controllers import (
    CONTROLLERS,
    DrillSharing,
    PseudoInverse,
    controller,
    taken_by_thrust,
)
from testbed.control.distribution.corrected import Corrected
from testbed.control.distribution.distribution import self_balanced
from testbed.control.distribution.quadratic import Quadratic
from testbed.control.distribution.statics import FEET, NORMALS, ROPES, Balance, Statics
from testbed.control.distribution.use_program import LastPlan, ProgramScale, UseProgram
from testbed.control.gait import Command, Measured
from testbed.control.layers import OFFSET_SPEED_M_S, Trim, haul, hauling
from testbed.errors import InputError
from testbed.machine.names import VERTICAL
from testbed.machine.scale import ROBOCLIMBER
from testbed.robot.rope_bearings import SurveyedRopes

WEIGHT_N = 4000 * 9.81


def _posture() -> np.ndarray:
    position = np.zeros(12)
    position[1::3], position[2::3] = 0.2, 0.25
    return position


def _balance(
    slope_deg: float,
    pull_n: float = 0.0,
    thrust_n: float = 0.0,
    legs: tuple[int, ...] = (0, 1, 2, 3),
) -> Balance:
    slope = np.radians(slope_deg)
    statics = Statics(shipped_model(), MACHINE, SurveyedRopes.along(30.0 * np.eye(3)[[0, 0]]))
    measured = Measured.of(
        position=_posture(),
        load=WEIGHT_N * np.cos(slope) / 4,
        contact=1.0,
        rope_tension=pull_n,
        attitude=[0.0, -slope, 0.0],
        supply_pressure=9.0e6,
        ordered_thrust=thrust_n,
    )
    return statics.balance(measured, np.isin(np.arange(4), legs))


@pytest.mark.parametrize("name", ["pseudo_inverse", "qp", "drill"])
@pytest.mark.parametrize("slope_deg", [0.0, 30.0, 60.0, 75.0])
def test_every_plan_balances_weight_ropes_and_drill(name: str, slope_deg: float) -> None:
    now = _balance(slope_deg, pull_n=WEIGHT_N * np.sin(np.radians(slope_deg)) / 2, thrust_n=2000.0)
    plan = controller(name).plan(now)
    load = now.load if plan.load is None else plan.load
    assert plan.feasible
    assert np.abs((now.balance @ plan.forces + load)[:3]).max() < 1e-3 * WEIGHT_N
    assert np.abs((now.balance @ plan.forces + load)[3:]).max() < 1e-3 * WEIGHT_N


def test_normal_loads_carry_the_weight_across_the_slope() -> None:
    """4 t on 60 degrees: 39 240 cos 60 = 19 620 N on the feet, less 2000 N of thrust."""
    plan = Quadratic().plan(_balance(60.0, pull_n=17_000.0, thrust_n=2000.0))
    assert plan.forces[NORMALS].sum() == pytest.approx(17_620.0, rel=1e-3)


def test_the_quadratic_program_lets_the_ropes_carry_the_pull_along_the_slope() -> None:
    """39 240 sin 60 = 33 983 N; what remains for friction is a few per cent of it."""
    plan = Quadratic().plan(_balance(60.0, pull_n=10_000.0))
    assert plan.forces[ROPES].sum() == pytest.approx(33_983.0, rel=0.05)


def test_without_ropes_the_least_friction_is_the_slopes_tangent() -> None:
    """tan 25 = 0.47, tan 40 = 0.84: rock of 0.65 holds the one and not the other (a pyramid of 8
    sides, 4 %).
    """
    for slope in (25.0, 40.0):
        now, sharing = _balance(slope), Quadratic()
        now.balance[:, ROPES] = 0.0
        for _ in range(60):
            z = sharing.plan(now).forces
        feet = z[:FEET].reshape(4, 3)
        use = (np.linalg.norm(feet[:, 1:], axis=1) / feet[:, 0]).max()
        assert use == pytest.approx(np.tan(np.radians(slope)), rel=0.04)


def test_a_plan_needs_no_more_friction_than_the_least_that_a_linear_program_finds() -> None:
    """Or no more than poor rock holds. The program is told no coefficient; ropes that pull aside
    make it hard.
    """
    from testbed.benchmarks.distribution.run import breaks, possible

    rng, hard = np.random.default_rng(0), 0
    for _ in range(12):
        slope = rng.uniform(60.0, 80.0)
        now = _balance(
            slope,
            pull_n=WEIGHT_N * np.sin(np.radians(slope)) / 2,
            thrust_n=rng.uniform(0.0, 3000.0),
        )
        now.load[1] += rng.uniform(-7000.0, 7000.0)
        now.load[3:] += rng.uniform(-3000.0, 3000.0, 3)
        for friction in np.arange(0.46, 0.85, 0.03):
            wanted = Quadratic(friction).constraints(now, 0.0)
            if possible(wanted):
                break
        else:
            continue
        sharing = Quadratic()
        for _ in range(60):
            plan = sharing.plan(now)
        assert plan.feasible and not breaks(plan.forces / wanted.scale, wanted)
        hard += friction > 0.47
    assert hard >= 2


@pytest.mark.parametrize("legs", [(0, 1, 2, 3), (0, 1, 3)])
def test_the_program_is_the_one_that_it_is_said_to_be_and_solved(legs: tuple[int, ...]) -> None:
    """Written down in plain arrays and solved by another library's way in, it has the same
    answer.
    """
    from qpsolvers import solve_qp

    now, stance = (
        _balance(40.0, pull_n=12_000.0, thrust_n=2000.0, legs=legs),
        np.isin(np.arange(4), legs),
    )
    scale = float(np.linalg.norm(now.load[:3]))
    normals, pull, taken = (
        np.array([0.2, 0.15, 0.25, 0.18]),
        np.array([0.3, 0.28]),
        np.array([-0.01, -0.02, 0.0, 0.01]),
    )
    sharing = Quadratic()
    about = ProgramScale(scale, 0.02, 0.8, 0.01, 0.4, 0.38, 30.0, 1.5, 0.02, 4.0)
    found = UseProgram(sharing._use_rows).solve(now, LastPlan(normals, pull, taken), about)
    rows, high = [], []
    for leg in legs:
        for angle in np.arange(8) * np.pi / 4:
            row = np.zeros(15)
            row[3 * leg + 1 : 3 * leg + 3] = np.array([np.cos(angle), np.sin(angle)]) / np.cos(
                np.pi / 8
            )
            row[3 * leg], row[14] = -0.4, -(normals[leg] + taken[leg])
            rows.append(row)
            high.append(-0.01 - 0.4 * normals[leg])
    joints, free = np.hstack([now.joint_map, np.zeros((12, 1))]), np.full(15, np.inf)
    below, above = -free, free.copy()
    below[0:12:3], below[12:14], above[12:14], below[14] = 0.02, 0.0, 0.8, 0.38
    below[:12][~np.repeat(stance, 3)] = above[:12][~np.repeat(stance, 3)] = 0.0
    weights = np.array([1.5, 30.0, 30.0] * 4 + [0.02, 0.02, 4.0])
    wanted = solve_qp(
        np.diag(weights),
        np.concatenate([np.zeros(12), -0.02 * pull, [0.0]]),
        np.vstack([rows, joints, -joints]),
        np.concatenate([high, (now.highest - now.held) / scale, -(now.lowest - now.held) / scale]),
        np.hstack([now.balance, np.zeros((6, 1))]),
        -now.load / scale,
        below,
        above,
        solver="daqp",
    )
    assert wanted is not None and found is not None
    assert np.abs(found - wanted).max() < 1e-6


def test_orders_of_an_agent_leave_the_body_alone_and_cost_the_least_force() -> None:
    now, agent = _balance(45.0, pull_n=12_000.0), Corrected()
    agent.plan(now)
    agent.order(np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.25]))
    plan = agent.plan(now)
    assert np.abs(now.balance @ plan.forces + now.load).max() < 1e-3 * WEIGHT_N
    beyond = np.zeros(14)
    beyond[0], beyond[13] = 1000.0, 500.0
    least = np.linalg.lstsq(now.balance[:, :FEET], now.balance @ beyond)[0]
    assert np.allclose(plan.forces[:FEET] - agent._planned[:FEET], beyond[:FEET] - least, atol=1e-6)


def test_no_plan_pulls_on_a_foot_or_pushes_a_rope_or_leaves_the_cone() -> None:
    for slope, thrust in ((30.0, 8000.0), (70.0, 4000.0), (80.0, 3000.0)):
        z = Quadratic().plan(_balance(slope, thrust_n=thrust)).forces
        feet = z[:FEET].reshape(4, 3)
        assert feet[:, 0].min() >= 0.0 and z[ROPES].min() >= 0.0
        assert np.all(
            np.linalg.norm(feet[:, 1:], axis=1) <= 0.65 * feet[:, 0] + 1e-2 * WEIGHT_N / 100
        )


def test_a_rope_is_never_asked_for_more_than_its_hoist_pulls() -> None:
    """Straight up a wall of 85 degrees with 8 t two hoists of 3.2 t each are not enough."""
    now = _balance(85.0)
    heavy = replace(now, load=2.0 * now.load)
    z = Quadratic().plan(heavy)
    assert not z.feasible
    assert Quadratic().plan(now).forces[ROPES].max() <= 31_400.0 * (1 + 1e-6)


def test_a_swinging_foot_is_given_nothing() -> None:
    z = Quadratic().plan(_balance(20.0, pull_n=6000.0, legs=(0, 1, 2))).forces
    assert np.abs(z[9:12]).max() < 1e-3 * WEIGHT_N


def test_a_weak_supply_bounds_the_joints() -> None:
    """At 5 bar over the tank the 70 mm bore lifts 1.9 kN: 4 t cannot stand on that."""
    now = _balance(0.0)
    weak = replace(now, lowest=now.lowest / 20, highest=now.highest / 20)
    assert Quadratic().plan(now).feasible
    assert not Quadratic().plan(weak).feasible


def test_pseudo_inverse_is_the_smallest_force_and_shares_evenly_on_level_ground() -> None:
    now = _balance(0.0)
    feet = PseudoInverse().plan(now).forces[:FEET]
    twisted = feet.copy()
    null = np.linalg.svd(now.balance[:, :FEET])[2][-1]
    assert np.linalg.norm(feet) < np.linalg.norm(twisted + 500.0 * null)
    assert feet[::3].sum() == pytest.approx(WEIGHT_N, rel=1e-6)


def test_thrust_takes_as_much_off_the_feet_as_it_pushes() -> None:
    """Four equal legs, thrust near their middle: about a quarter each, one newton in all."""
    taken = taken_by_thrust(_balance(45.0))
    assert taken.sum() == pytest.approx(-1.0, abs=1e-9)
    assert taken == pytest.approx(np.full(4, -0.25), abs=0.03)


def test_the_drilling_controller_finds_a_thrust_that_nobody_ordered() -> None:
    """The feet carry 1200 N less than weight and order say; after four time constants it believes
    in 1200 N.
    """
    now, sharing = _balance(45.0, pull_n=13_800.0), DrillSharing()
    measured = now.measured.copy()
    lost = -(now.load[2] + now.balance[2, ROPES] @ measured[ROPES]) - 1200.0
    measured[NORMALS] = lost / 4
    for _ in range(400):
        sharing.plan(replace(now, measured=measured))
    assert sharing.disturbance_n == pytest.approx(1200.0, rel=0.03)


def test_the_drilling_controller_leaves_the_weakest_foot_more_than_the_even_one() -> None:
    now = _balance(75.0, pull_n=19_000.0, thrust_n=2500.0)
    drill, even = DrillSharing().plan(now).forces[NORMALS], Quadratic().plan(now).forces[NORMALS]
    assert drill.min() >= even.min() - 1.0


def test_what_moves_the_body_and_what_squeezes_it_are_apart() -> None:
    """Six of twelve foot displacements move the body as a whole; the twist is none of them, height
    is one.
    """
    now = _balance(45.0)
    height = np.tile([1.0, 0.0, 0.0], 4)
    twist = np.zeros(12)
    twist[::3] = [1.0, -1.0, -1.0, 1.0]
    assert now.rigid.shape == (12, 6)
    assert now.rigid @ (now.rigid.T @ height) == pytest.approx(height)
    assert np.linalg.norm(now.rigid.T @ twist) < 0.05 * np.linalg.norm(twist)


def test_of_the_errors_only_what_is_self_balanced_is_acted_upon() -> None:
    """A squeeze passes unchanged; what moves the body, and what ropes put on the feet, is taken
    off.
    """
    now = _balance(45.0)
    jacobian = -now.joint_map[:, :FEET].T
    squeeze = now.inner @ np.array([100.0, -50.0, 80.0, 20.0, -30.0, 60.0])
    errors = self_balanced(now, jacobian)
    assert errors @ np.append(squeeze, [0.0, 0.0]) == pytest.approx(squeeze)
    assert np.abs(now.balance[:, :FEET] @ errors).max() < 1e-12
    feet, pull = now.balance[:, :FEET], np.array([500.0, -200.0])
    borne = -np.linalg.pinv(feet) @ (now.balance[:, ROPES] @ pull)
    assert errors @ np.concatenate([borne, pull]) == pytest.approx(np.zeros(FEET), abs=1e-8)


def test_rope_is_hauled_in_where_tension_lacks_and_rests_at_what_is_wanted() -> None:
    """1000 N too little: 1e-5 m/s per N hauls in 10 mm/s."""
    rates = np.zeros(2)
    haul(np.array([9000.0, 10_010.0]), np.full(2, 10_000.0), hauling(ROBOCLIMBER), rates)
    assert rates == pytest.approx([-0.01, 0.0])


def test_trim_lays_an_offset_over_the_inner_set_points() -> None:
    trim, held = Trim(), Command(_posture())
    trim.goal_m = np.array([1e-4, 0.0, 0.0, -1e-4])
    moved = [trim.over(held, t, 0.01, Measured.of()).joints[list(VERTICAL)] for t in (0.0, 0.01)]
    assert moved[0] == pytest.approx([0.2501, 0.25, 0.25, 0.2499])
    assert moved[1] == pytest.approx(moved[0])
    trim.goal_m[0] = 1.0
    further = trim.over(held, 0.02, 0.01, Measured.of())
    assert further.joints[VERTICAL[0]] - moved[1][0] == pytest.approx(0.01 * OFFSET_SPEED_M_S)


def test_unknown_controller_is_refused_with_the_names_there_are() -> None:
    with pytest.raises(InputError, match="position_hold"):
        controller("no_such")
    with pytest.raises(InputError, match="no such file"):
        controller("no_such.py:Mine")
    assert set(CONTROLLERS) == {"position_hold", "pseudo_inverse", "qp", "drill", "learned"}


def test_the_shipped_policy_says_how_it_was_made_and_corrects_the_plan_within_its_reach() -> None:
    from testbed.control.distribution.controllers import SHIPPED

    assert str(np.load(SHIPPED)["made_by"]).startswith("testbed train force-distribution")
    now, learned, plain = _balance(45.0, pull_n=14_000.0), controller("learned"), Quadratic()
    for _ in range(10):
        forces, planned = learned.plan(now).forces, plain.plan(now).forces
    assert 0.0 < np.abs(forces - planned).max() <= 2000.0
    assert np.abs(now.balance @ forces + now.load).max() < 1.0
    with pytest.raises(InputError, match=r"no_such\.npz: no such file"):
        controller("no_such.npz")


def test_a_controller_of_ones_own_is_a_file_and_a_class(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(
        "from testbed.control.distribution.quadratic import Quadratic\nclass Mine(Quadratic): ...\n"
    )
    assert controller(f"{file}:Mine").plan(_balance(30.0)).feasible
    with pytest.raises(InputError, match="no such class"):
        controller(f"{file}:Other")
