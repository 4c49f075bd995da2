"""`truth_machine.yaml`: the machine that a run drew, under the names by which `testbed commission`
finds its numbers.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.estimation.commissioning import zero_name
from testbed.estimation.live.uncertainty import areas_m2
from testbed.formats.arrays import Array
from testbed.machine.names import AXES
from testbed.robot.model import RobotModel
from testbed.scenario.scenario import Scenario

TRUTH_MACHINE = "truth_machine.yaml"
FORMAT = "roboclimber-truth-machine/1"
WEIGHED = ("total_mass_kg", "centre_of_mass_x_m", "centre_of_mass_y_m", "centre_of_mass_z_m")
"""What a machine weighs, load in the rod store included, and where; its joints in the middle of
their ranges.
"""


def truth_machine(scenario: Scenario, simulation: Any) -> dict[str, Any]:
    """Every drawn number, and what they make of the whole machine's weight."""
    world = simulation.machine
    masses = [world.hidden.cylinders[axis].mass_kg for axis in AXES]
    weighed = zip(
        WEIGHED, weigh(world.kinematics, np.array(masses)), ("kg", "m", "m", "m"), strict=True
    )
    return {
        "format": FORMAT,
        "draw": scenario.machine.draw,
        "seed": scenario.machine.seed,
        "numbers": {name: {"value": float(value), "unit": unit} for name, value, unit in weighed}
        | zero_forces(simulation)
        | simulation.machines.drawn.numbers,
    }


def zero_forces(simulation: Any) -> dict[str, Any]:
    """What both sensors' zeros of each cylinder make together, N: one foot in the air shows no
    more.
    """
    out = {}
    for axis in AXES:
        hidden = simulation.machine.hidden.cylinders[axis]
        area_a, area_b = areas_m2(simulation.machines.belief.axes[axis])
        force_n = area_a * hidden.zero_a_pa - area_b * hidden.zero_b_pa
        out[zero_name(axis)] = {"value": force_n, "unit": "N"}
    return out


def weigh(model: RobotModel, link_masses_kg: Array) -> tuple[float, ...]:
    """Total mass and centre of mass, body frame, with `link_masses_kg` (12) added at the centres of
    the axes' links.
    """
    joints = model.limits.mean(axis=1)
    total = model.total_mass_kg + float(np.sum(link_masses_kg))
    moment = model.total_mass_kg * model.centre_of_mass_m(joints)
    moment = moment + link_masses_kg @ model.link_centres_m(joints)
    return (total, *(moment / total).tolist())
