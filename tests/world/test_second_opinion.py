"""MuJoCo, reading the same URDF, agrees that the simulated stands are in equilibrium: five of them."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from testbed import resources
from testbed.machine.names import AXES, GRAVITY_M_S2, LEGS, SIDES
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation

STANDS = {
    "level": ("terrain.slope_deg=0", "ropes.enabled=false"),
    "45 degrees": (),
    "75 degrees": ("terrain.slope_deg=75", "ropes.share=1.0"),
    "payload": ("events=[{kind: payload, at_s: 0.1, mass_kg: 300}]",),
    "low": ("robot.vertical_m=0.15",),
}
SECONDS, LAST_MS = 1.5, 300
MASS_KG = 4000.0


def _settled(*changes: str) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray, float]:
    """Means over the last LAST_MS of the truth by column group; joints (12), rotation (3, 3), the mass carried, kg."""
    scenario = load_scenario(
        "stand_slope_45", ["hydraulics.valves_locked=true", *changes], duration=SECONDS
    )
    simulation = Simulation(scenario)
    try:
        _, truth = simulation.run_block(round(SECONDS * scenario.rates.record_hz))
        names = simulation.truth_columns
        board = simulation.machine.board
        joints, rotation = board.engine.joint.copy(), board.rotation.copy()
        extra = float(simulation.machine.engine.masses().sum()) - MASS_KG
    finally:
        simulation.close()
    mean = truth[-LAST_MS:].mean(axis=0)
    groups = {
        group: np.array([mean[k] for k, name in enumerate(names) if name.startswith(group)])
        for group in ("foot_force_in_world", "rope_force_in_world")
    }
    return groups, joints, rotation, extra


@pytest.mark.slow
@pytest.mark.parametrize("stand", STANDS)
def test_a_settled_stand_is_in_equilibrium_in_mujoco(stand: str) -> None:
    """Sum, front-rear and left-right: what the feet carry, as MuJoCo's gravity and its feet's places ask for it."""
    forces, joints, rotation, extra = _settled(*STANDS[stand])
    spec = mujoco.MjSpec.from_string(resources.urdf().read_text())
    spec.compiler.fusestatic = False
    spec.worldbody.first_body().add_freejoint()
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:7] = (0, 0, 0, 1, 0, 0, 0)
    for name, value in zip(AXES, joints, strict=True):
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_forward(model, data)
    masses = model.body_mass.copy()
    masses[model.body("rod_store").id] += extra  # where a payload rides
    gravity = rotation.T @ np.array([0.0, 0.0, -GRAVITY_M_S2])
    soles = np.array([data.body(f"{leg}_foot").xpos for leg in LEGS])
    pulls_at = np.array([data.body(f"traction_{side}").xpos for side in SIDES])
    feet = forces["foot_force_in_world"].reshape(4, 3) @ rotation
    ropes = forces["rope_force_in_world"].reshape(2, 3) @ rotation
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
