"""MuJoCo, reading the same URDF, agrees on the simulated stands: equilibrium of the whole, and each
foot by its leg.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco
import numpy as np
import numpy.typing as npt
import pytest

from testbed import resources
from testbed.machine.names import AXES, GRAVITY_M_S2, LEGS, SIDES
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation

Array = npt.NDArray[np.float64]
ALONG_GROUND = 0.005
"""Share by which a foot's force along the ground may differ, of the most that a foot has."""
DRILLING = "task={kind: drill, start_s: 0, phases: [{kind: push, duration_s: 5, feed_n: 4000}]}"
PAYLOAD = "{kind: payload, at_s: 0.1, mass_kg: 300}"
PUSH = "{kind: shove, at_s: 0.1, duration_s: 9, force_in_world_n: [1500, 2500, 0]}"
"""A steady push across the slope, which the feet have to take along the ground."""
PUSHED = {
    "level": ("terrain.slope_deg=0", "ropes.enabled=false", f"events=[{PUSH}]"),
    "45 degrees": (f"events=[{PUSH}]",),
    "75 degrees": ("terrain.slope_deg=75", "ropes.share=1.0", f"events=[{PUSH}]"),
    "payload": (f"events=[{PAYLOAD}, {PUSH}]",),
    "drilling mean": (DRILLING, f"events=[{PUSH}]"),
}
STANDS = {
    "level": ("terrain.slope_deg=0", "ropes.enabled=false"),
    "45 degrees": (),
    "75 degrees": ("terrain.slope_deg=75", "ropes.share=1.0"),
    "payload": (f"events=[{PAYLOAD}]",),
    "low": ("robot.vertical_m=0.15",),
}
SECONDS, LAST_MS = 1.5, 300
MASS_KG = 4000.0
EACH_FOOT = 0.02
"""Share of its normal load by which each foot's force may differ."""
GROUND_N_M = 1.0e8
LEVEL = ("terrain.slope_deg=0", "ropes.enabled=false")
SPRINGS_ALONE = (
    *LEVEL,
    f"terrain.stiffness_n_m={GROUND_N_M:g}",
    "hydraulics.without=[friction, hose, leakage]",
)
"""Locked cylinders that are springs of oil and hose, and nothing else."""
PAYLOAD_KG = 300.0


class Settled(NamedTuple):
    """Means over the last LAST_MS: forces in the world, N; joint torques (12); joints; rotation;
    mass carried, kg; stiffness of the cylinders (12), N/m.
    """

    feet_n: Array
    """From the balance of each leg, as recorded."""
    contacts_n: Array
    """From the engine's contacts."""
    ropes_n: Array
    torques: Array
    joints: Array
    rotation: Array
    extra_kg: float
    springs_n_m: Array


def _settled(*changes: str) -> Settled:
    scenario = load_scenario(
        "stand_slope_45", ["hydraulics.valves_locked=true", *changes], duration=SECONDS
    )
    simulation = Simulation(scenario)
    try:
        before = round(SECONDS * scenario.rates.record_hz) - LAST_MS
        simulation.run_block(before)
        rows, torques, contacts = [], [], []
        board, feet = simulation.machine.board, simulation.machine.engine.feet
        for _ in range(LAST_MS):
            rows.append(simulation.run_block(1)[1][0])
            torques.append(board.given.joint_torque.copy())
            contacts.append(np.empty((4, 3)))
            feet.forces(contacts[-1], np.empty(4))
        mean, names = np.mean(rows, axis=0), simulation.truth_columns
        groups = [
            np.array([mean[k] for k, name in enumerate(names) if name.startswith(group)])
            for group in ("foot_force_in_world", "rope_force_in_world")
        ]
        extra = float(simulation.machine.engine.masses().sum()) - MASS_KG
        return Settled(
            groups[0].reshape(4, 3),
            np.mean(contacts, axis=0),
            groups[1].reshape(2, 3),
            np.mean(torques, axis=0),
            board.engine.joint.copy(),
            board.rotation.copy(),
            extra,
            np.array([_spring_n_m(*axis) for axis in zip(*_cylinders(board), strict=True)]),
        )
    finally:
        simulation.close()


def _cylinders(board: Any) -> tuple[Any, Any, list[float]]:
    """State, parameters and extension of each cylinder."""
    return board.axes, board.parameters, [rod.extension for rod in board.inputs]


def _spring_n_m(state: Any, own: Any, extension: float) -> float:
    """A^2 / (V (1 / K + a / (1.4 p) (p0 / p)^(1 / 1.4)) + E) of both chambers of a locked
    cylinder.
    """
    total = 0.0
    rooms = (own.a, state.a, extension), (own.b, state.b, own.stroke - extension)
    for chamber, oil, length in rooms:
        gas = own.oil.air / (1.4 * oil.pressure) * (1e5 / oil.pressure) ** (1.0 / 1.4)
        gives = (chamber.dead_volume + chamber.area * length) * (1.0 / own.oil.bulk_modulus + gas)
        total += chamber.area**2 / (gives + chamber.hose_elasticity)
    return float(total)


def _mujoco(joints: Array) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The shipped URDF with a free base at the origin, its joints so."""
    spec = mujoco.MjSpec.from_string(resources.urdf().read_text())
    spec.compiler.fusestatic = False
    spec.worldbody.first_body().add_freejoint()
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:7] = (0, 0, 0, 1, 0, 0, 0)
    for name, value in zip(AXES, joints, strict=True):
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.slow
@pytest.mark.parametrize("stand", STANDS)
def test_a_settled_stand_is_in_equilibrium_in_mujoco(stand: str) -> None:
    """Sum, front-rear and left-right: what the feet carry, as MuJoCo's gravity and its feet's
    places ask for it.
    """
    settled = _settled(*STANDS[stand])
    rotation = settled.rotation
    model, data = _mujoco(settled.joints)
    masses = model.body_mass.copy()
    masses[model.body("rod_store").id] += settled.extra_kg  # where a payload rides
    gravity = rotation.T @ np.array([0.0, 0.0, -GRAVITY_M_S2])
    soles = np.array([data.body(f"{leg}_foot").xpos for leg in LEGS])
    pulls_at = np.array([data.body(f"traction_{side}").xpos for side in SIDES])
    feet, ropes = settled.feet_n @ rotation, settled.ropes_n @ rotation
    weights = masses[:, None] * gravity
    total = feet.sum(axis=0) + ropes.sum(axis=0) + weights.sum(axis=0)
    moments = sum(
        np.cross(places, loads).sum(axis=0)
        for places, loads in ((soles, feet), (pulls_at, ropes), (data.xipos, weights))
    )
    allowed = 1e-3 * MASS_KG * GRAVITY_M_S2 / 4.0
    length, width = np.ptp(soles[:, 0]), np.ptp(soles[:, 1])
    assert np.abs(total).max() < allowed
    assert abs(moments[1]) / length < allowed
    assert abs(moments[0]) / width < allowed


@pytest.mark.slow
@pytest.mark.parametrize("stand", PUSHED)
def test_each_foot_carries_what_its_leg_says_in_mujoco(stand: str) -> None:
    """Cylinders push a leg's three joints, MuJoCo weighs its links: three equations for the force
    under its foot. They are held against the engine's contacts and against what is recorded, normal
    and along the ground, while the robot is pushed aside.
    """
    settled = _settled(*PUSHED[stand])
    model, data = _mujoco(settled.joints)
    model.opt.gravity[:] = settled.rotation.T @ np.array([0.0, 0.0, -GRAVITY_M_S2])
    mujoco.mj_forward(model, data)
    expected = np.empty((4, 3))
    for k, leg in enumerate(LEGS):
        columns = [model.joint(name).dofadr[0] for name in AXES[3 * k : 3 * k + 3]]
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jacBody(model, data, jacobian, None, model.body(f"{leg}_foot").id)
        wanted = data.qfrc_bias[columns] - settled.torques[3 * k : 3 * k + 3]
        expected[k] = np.linalg.solve(jacobian[:, columns].T, wanted)
    along = np.linalg.norm(expected[:, :2], axis=1)
    assert along.max() > 800.0
    for found in (settled.contacts_n @ settled.rotation, settled.feet_n @ settled.rotation):
        off = np.abs(found - expected)
        assert (off[:, 2] < EACH_FOOT * expected[:, 2]).all()
        assert off[:, :2].max() < ALONG_GROUND * along.max()


@pytest.mark.slow
@pytest.mark.parametrize("stance", [(), ("robot.vertical_m=0.15", "robot.radial_m=0.3")])
def test_a_payload_falls_to_the_feet_as_springs_in_the_joints_share_it(
    stance: tuple[str, ...],
) -> None:
    """MuJoCo's kinematics with a spring in every joint and in the ground: the body sinks, rolls and
    pitches until the feet carry the payload. They creep sideways until nothing pulls them.
    """
    empty, loaded = (
        _settled(*SPRINGS_ALONE, *stance, *more)
        for more in ((), (f"events=[{{kind: payload, at_s: 0.1, mass_kg: {PAYLOAD_KG:g}}}]",))
    )
    model, data = _mujoco(empty.joints)
    up = empty.rotation[2]  # in the body's frame
    moves, gives = [], []
    for k, leg in enumerate(LEGS):
        own = slice(3 * k, 3 * k + 3)
        jacobian = np.zeros((3, model.nv))
        foot = model.body(f"{leg}_foot").id
        mujoco.mj_jacBody(model, data, jacobian, None, foot)
        columns = [model.joint(name).dofadr[0] for name in AXES[own]]
        # a straight cylinder has the arm 1; that of the rotation moves no foot up or down
        along = up @ jacobian[:, columns]
        gives.append(float(np.sum(along**2 / empty.springs_n_m[own])) + 1.0 / GROUND_N_M)
        moves.append([1.0, *np.cross(data.xpos[foot], up)[:2]])
    at = data.body("rod_store").xipos
    weight = PAYLOAD_KG * GRAVITY_M_S2 * np.array([1.0, *np.cross(at, up)[:2]])
    shares = np.array(moves) / np.array(gives)[:, None]
    expected = shares @ np.linalg.solve(np.array(moves).T @ shares, weight)
    change = (loaded.feet_n - empty.feet_n) @ empty.rotation
    carried = empty.feet_n[:, 2]
    assert np.ptp(expected) > 500.0
    assert np.abs(change @ up - expected).max() < 0.002 * carried.min()
    assert np.abs(change[:, :2]).max() < EACH_FOOT * carried.min()
