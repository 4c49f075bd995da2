"""A machine of one's own, looked at before anything runs: its URDF drawn, its figures worked
out.
"""

from __future__ import annotations

import math
from typing import Any

from testbed.errors import naming
from testbed.formats.files import write_text
from testbed.machine.build import build_machine
from testbed.machine.folder import BODIES, NUMBERS, drawing_board, machine_folder, read_head
from testbed.machine.model import Machine
from testbed.machine.names import GRAVITY_M_S2
from testbed.machine.urdf_check import lacking

HEADS = ["figure", "value", "unit"]


def check_machine(given: str, draw: bool = False) -> dict[str, Any]:
    """Name, folder and figures of a machine; its URDF is drawn where it has none, or anew with
    `draw`.

    Raises InputError for numbers or a URDF that cannot be.
    """
    from testbed.robot.robot import Robot
    from testbed.robot.urdf.generate import urdf_text

    folder = machine_folder(given)
    head = read_head(folder)
    if draw or not (folder / BODIES).is_file():
        name = "_".join(head.name.split())
        write_text(folder / BODIES, urdf_text(drawing_board(folder), name, head.without))
    machine = build_machine(folder=folder)
    with naming(folder / NUMBERS):
        Robot.of(machine)
    return {"name": head.name, "folder": str(folder), "figures": _figures(machine)}


def _figures(machine: Machine) -> dict[str, tuple[Any, str]]:
    """What a person looks at first: name -> value, unit."""
    legs = machine.each_leg.values()
    vertical = [machine.axes[f"{leg}_vertical"] for leg in machine.each_leg]
    bore_m = min(axis.cylinder.bore_m for axis in vertical)
    push_n = machine.power_unit.supply_pressure_pa * math.pi / 4.0 * bore_m**2
    quarter_n = 0.25 * machine.total_mass_kg * GRAVITY_M_S2
    strokes = {
        joint: min(machine.axes[f"{leg}_{joint}"].stroke_m for leg in machine.each_leg)
        for joint in ("radial", "vertical")
    }
    turn = machine.joints.rotation
    return {
        "total mass": (round(machine.total_mass_kg, 1), "kg"),
        "weight of a quarter": (round(quarter_n), "N"),
        "push of a vertical cylinder at full supply": (round(push_n), "N"),
        "that push over the quarter": (round(push_n / quarter_n, 2), "1"),
        "hips, front to rear": (round(2.0 * max(leg.hip_x_m for leg in legs), 3), "m"),
        "radial stroke, shortest": (round(strokes["radial"], 4), "m"),
        "vertical stroke, shortest": (round(strokes["vertical"], 4), "m"),
        "rotation": (
            f"{math.degrees(turn.lower_rad):.1f} to {math.degrees(turn.upper_rad):.1f}",
            "deg",
        ),
        "supply": (round(machine.power_unit.supply_pressure_pa / 1e5, 1), "bar"),
        "without": (", ".join(sorted(lacking(machine.urdf))) or "nothing", ""),
        "scale of force and length": (f"{machine.scale.force:g}, {machine.scale.length:g}", "1"),
    }
