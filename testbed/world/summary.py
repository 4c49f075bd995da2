"""What only the world knows of a whole run, how far its task has come, and what was known before
it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from testbed.control.gait import Gait, Layered
from testbed.machine.folder import is_shipped_urdf
from testbed.machine.names import SIDES
from testbed.world.drilling.drilling import Drilling

if TYPE_CHECKING:
    from testbed.scenario.parts import Ropes
    from testbed.world.simulation import Simulation


def world_summary(simulation: Simulation) -> dict[str, Any]:
    """What only the world knows of the whole run."""
    m = simulation.machine
    to_its_end = simulation.finished and simulation.verdict == "stood"
    return {
        "foot_slip_m": m.judge.slip_m,
        "rope_slip_m": float(m.board.devices["slipped"].max()),
        "turn_max_deg": math.degrees(m.judge.turn_rad),
        **m.drill.summary(),
        **m.settlement(),
        "progress": progress(m.gait, m.drill, simulation.t_s, to_its_end),
        "pump_work_j": float(m.board.supply.pump_work),
        "oil_temperature_degc": float(m.board.supply.temperature),
        "total_mass_kg": float(m.engine.masses().sum()),
        "thrust_reserve_n": m.thrust.reserve_n,
        "body_travel_m": float(np.linalg.norm(m.origin_in_world() - m.start_base)),
    }


def surveyed(simulation: Simulation) -> dict[str, Any]:
    """What people measured of the place and the load before the run, and what is believed of the
    machine: its URDF, how far it may be from its drawing.
    """
    scenario, urdf = simulation.scenario, simulation.machines.belief.urdf
    ropes = simulation.machine.expectation.surveyed
    return {
        "rope_directions_in_world": {s: ropes.directions[k].tolist() for k, s in enumerate(SIDES)},
        "rope_lengths_m": {s: float(ropes.distances_m[k]) for k, s in enumerate(SIDES)},
        "rope_attachment_height_m": scenario.ropes.attachment_height_m,
        "rope_stiffness_n_m": rope_stiffness_n_m(scenario.ropes),
        "payload_kg": scenario.carried_kg,
        "urdf": None if is_shipped_urdf(urdf) else str(urdf.resolve()),
        "tolerances": scenario.tolerances,
    }


def rope_stiffness_n_m(ropes: Ropes) -> float | None:
    """Of each rope as it is declared and hangs at the start, N/m; None: there are none."""
    length_m = math.hypot(ropes.anchor_distance_m, 0.5 * ropes.anchor_spread_m)
    return ropes.stiffness_ea_n / length_m if ropes.enabled else None


def progress(gait: Gait, drill: Drilling, t: float, to_its_end: bool) -> dict[str, Any]:
    """`done` (of a task that has no end of its own: whether the run came to its end), and how much
    of what was wanted is made.

    A gait tells by a method `progress(t)`, one of a user's own too: a mapping with `done`.
    """
    while isinstance(gait, Layered):
        gait = gait.gait
    own_progress = getattr(gait, "progress", None)
    parts = [drill.progress(), *([] if own_progress is None else [own_progress(t)])]
    ends = [bool(part["done"]) for part in parts if "done" in part] or [to_its_end]
    found: dict[str, Any] = {"done": True}
    for part in parts:
        found |= part
    return found | {"done": all(ends)}
