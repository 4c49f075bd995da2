"""A machine of one's own, looked at before anything runs: its URDF drawn, its figures worked
out.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from testbed.errors import naming
from testbed.formats.files import write_text
from testbed.machine.build import ALIKE, build_machine
from testbed.machine.folder import BODIES, NUMBERS, drawing_board, machine_folder, read_head
from testbed.machine.frame_groups import RotationLinkage
from testbed.machine.model import Axis, Machine, least_rate_hz
from testbed.machine.names import GRAVITY_M_S2, JOINTS, VERTICAL
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
    push_n = _least_push_n(machine)
    quarter_n = 0.25 * machine.total_mass_kg * GRAVITY_M_S2
    strokes = {
        joint: min(machine.axes[f"{leg}_{joint}"].travel_m for leg in machine.each_leg)
        for joint in ("radial", "vertical")
    }
    turns = {machine.axes[f"{leg}_rotation"].limits.ends for leg in machine.each_leg}
    return {
        "total mass": (round(machine.total_mass_kg, 1), "kg"),
        "weight of a quarter": (round(quarter_n), "N"),
        "least push of a vertical cylinder on its foot, full supply": (round(push_n), "N"),
        "that push over the quarter": (round(push_n / quarter_n, 2), "1"),
        "hips, front to rear": (round(2.0 * max(leg.hip_x_m for leg in legs), 3), "m"),
        "radial stroke, shortest": (round(strokes["radial"], 4), "m"),
        "vertical stroke, shortest": (round(strokes["vertical"], 4), "m"),
        "rotation": (", ".join(_degrees(*ends) for ends in sorted(turns)), "deg"),
        **_linkage_figures(machine),
        "supply": (round(machine.power_unit.supply_pressure_pa / 1e5, 1), "bar"),
        "least rates.physics_hz": (least_rate_hz(machine), "Hz"),
        "without": (", ".join(sorted(lacking(machine.urdf))) or "nothing", ""),
        "scale of force and length": (f"{machine.scale.force:g}, {machine.scale.length:g}", "1"),
    }


def _degrees(lower_rad: float, upper_rad: float) -> str:
    return f"{math.degrees(lower_rad):.1f} to {math.degrees(upper_rad):.1f}"


def _least_push_n(machine: Machine) -> float:
    """What the weakest vertical cylinder pushes its foot with, drawn in or out, at full supply."""
    from testbed.robot.linkage import Linkages

    linkages = Linkages.from_machine(machine)
    arms = np.array([linkages.rods(ends)[1] for ends in linkages.limits.T]).min(axis=0)
    bores = np.array([axis.cylinder.bore_m for axis in machine.axes.values()])
    pushes = machine.power_unit.supply_pressure_pa * math.pi / 4.0 * bores**2 * arms
    return float(pushes[list(VERTICAL)].min())


def _linkage_figures(machine: Machine) -> dict[str, tuple[Any, str]]:
    """Of each joint the kinds of its linkages with the arms' range."""
    from testbed.robot.linkage import Linkages

    linkages = Linkages.from_machine(machine)
    share = np.linspace(0.0, 1.0, 21)[:, None]
    lower, upper = linkages.limits.T
    arms = linkages.rods(lower + share * (upper - lower))[1]
    out = {}
    for index, joint in enumerate(JOINTS):
        own = slice(index, None, len(JOINTS))
        kinds = sorted({_kind_of(axis) for axis in list(machine.axes.values())[own]})
        least, most = float(arms[:, own].min()), float(arms[:, own].max())
        span = f"{least:.3g}" if most - least < ALIKE else f"{least:.3g} to {most:.3g}"
        out[f"{joint}, rod by joint ({', '.join(kinds)})"] = (
            span,
            "m/rad" if joint == "rotation" else "1",
        )
    return out


def _kind_of(axis: Axis) -> str:
    """How a cylinder moves its joint, in a word."""
    if isinstance(axis.linkage, RotationLinkage):
        return "rack" if axis.linkage.rack_radius_m > 0.0 else "lever"
    return "inclined" if axis.linkage.across_m > 0.0 else "straight"
