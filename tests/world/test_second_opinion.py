"""MuJoCo, reading the same URDF, agrees on the simulated stands: equilibrium of the whole, and each
foot by its leg.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
import numpy.typing as npt
import pytest

from testbed import resources
from testbed.machine.names import AXES, GRAVITY_M_S2, LEGS, SIDES
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation

Array = npt.NDArray[np.float64]
STANDS = {
    "level": ("terrain.slope_deg=0", "ropes.enabled=false"),
    "45 degrees": (),
    "75 degrees": ("terrain.slope_deg=75", "ropes.share=1.0"),
    "payload": ("events=[{kind: payload, at_s: 0.1, mass_kg: 300}]",),
    "low": ("robot.vertical_m=0.15",),
}
SECONDS, LAST_MS = 1.5, 300
MASS_KG = 4000.0
EACH_FOOT = 0.02
"""Share of its normal load by which each foot's force may differ."""
DRILLING = ("task={kind: drill, start_s: 0, phases: [{kind: push, duration_s: 5, feed_n: 4000}]}",)


class Settled(NamedTuple):
    """Means over the last LAST_MS: forces in the world, N; joint torques (12); joints; rotation;
    mass carried, kg.
    """

    feet_n: Array
    ropes_n: Array
    torques: Array
    joints: Array
    rotation: Array
    extra_kg: float


def _settled(*changes: str) -> Settled:
    scenario = load_scenario(
        "stand_slope_45", ["hydraulics.valves_locked=true", *changes], duration=SECONDS
    )
    simulation = Simulation(scenario)
    try:
        before = round(SECONDS * scenario.rates.record_hz) - LAST_MS
        simulation.run_block(before)
        rows, torques = [], []
        board = simulation.machine.board
        for _ in range(LAST_MS):
            rows.append(simulation.run_block(1)[1][0])
            torques.append(board.given.joint_torque.copy())
        mean, names = np.mean(rows, axis=0), simulation.truth_columns
        groups = [
            np.array([mean[k] for k, name in enumerate(names) if name.startswith(group)])
            for group in ("foot_force_in_world", "rope_force_in_world")
        ]
        extra = float(simulation.machine.engine.masses().sum()) - MASS_KG
        return Settled(
            groups[0].reshape(4, 3),
            groups[1].reshape(2, 3),
            np.mean(torques, axis=0),
            board.engine.joint.copy(),
            board.rotation.copy(),
            extra,
        )
    finally:
        simulation.close()


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
@pytest.mark.parametrize("stand", ["level", "45 degrees", "75 degrees", "payload", "drilling mean"])
def test_each_foot_carries_what_its_leg_says_in_mujoco(stand: str) -> None:
    """Cylinders push a leg's three joints, MuJoCo weighs its links: three equations for the force
    under its foot.

    Normal and tangential; the machine's tangential forces are small, so both are judged by the
    normal load.
    """
    settled = _settled(*(STANDS | {"drilling mean": DRILLING})[stand])
    model, data = _mujoco(settled.joints)
    model.opt.gravity[:] = settled.rotation.T @ np.array([0.0, 0.0, -GRAVITY_M_S2])
    mujoco.mj_forward(model, data)
    feet = settled.feet_n @ settled.rotation
    for k, leg in enumerate(LEGS):
        columns = [model.joint(name).dofadr[0] for name in AXES[3 * k : 3 * k + 3]]
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jacBody(model, data, jacobian, None, model.body(f"{leg}_foot").id)
        wanted = data.qfrc_bias[columns] - settled.torques[3 * k : 3 * k + 3]
        found = np.linalg.solve(jacobian[:, columns].T, wanted)
        assert np.abs(found - feet[k]).max() < EACH_FOOT * feet[k, 2], leg
