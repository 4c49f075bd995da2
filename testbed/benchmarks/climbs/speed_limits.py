"""How fast a machine could climb at best: bounds from its numbers, whatever the gait.

Every metre of way takes oil: the traction devices haul it and go back for it, each leg's rotation
or radial cylinder goes along with the body and back to its next foothold, each vertical cylinder
goes up and down once a stride. With one leg in the air at a time a stride takes at least four
swings; a body that goes on meanwhile leaves each leg three quarters of the stride to make up for,
and a foot may rise and come down on its way. A leg that turns uphill may carry the highest load of
all, which leaves its valve the supply's margin. None of the bounds counts a wait, a search for the
ground, a ramp, or the sway that takes the body away from the foot in the air: no gait of this
machine is faster than the lowest of them.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from testbed.control.gaits.crawl.pace import margin_share
from testbed.formats.arrays import Array
from testbed.laws.traction import RESERVE_M
from testbed.machine.model import Machine
from testbed.machine.names import GRAVITY_M_S2, LEGS
from testbed.robot.linkage import Linkages


@dataclass(frozen=True)
class Limits:
    """Bounds on the mean speed up the slope, m/s, each by what it comes from."""

    pump_flow: float
    pump_power: float
    valves: float
    ropes: float

    @property
    def lowest(self) -> tuple[str, float]:
        """The bound that binds, by name."""
        return min(asdict(self).items(), key=lambda item: item[1])


def speed_limits(
    machine: Machine, stride_m: float, lift_m: float, slope_deg: float, mass_kg: float
) -> Limits:
    """Bounds of a machine of `mass_kg` that climbs straight up with strides of `stride_m`, feet
    lifted by `lift_m`.
    """
    unit, traction = machine.power_unit, machine.traction
    across, lift = _travel(machine)
    hauling = 2.0 * (traction.piston_area_m2 + traction.annulus_area_m2)
    legs = len(LEGS) * float(across.volume.sum() + lift.volume.sum() * lift_m / stride_m)
    lifting_n = mass_kg * GRAVITY_M_S2 * float(np.sin(np.radians(slope_deg)))
    own_m = (1.0 - 1.0 / len(LEGS)) * stride_m
    swing_s = max(own_m * float(across.seconds.max()), 2.0 * lift_m * float(lift.seconds.max()))
    return Limits(
        pump_flow=unit.full_flow_m3_s / (hauling + legs),
        pump_power=unit.power_w / lifting_n if lifting_n > 0.0 else float("inf"),
        valves=stride_m / (len(LEGS) * swing_s),
        ropes=_hauled_m_s(machine),
    )


@dataclass(frozen=True)
class _Travel:
    """What a metre of a foot's way takes of its cylinders at the leg's neutral direction."""

    volume: Array
    """Oil that a metre there and a metre back take, m3."""
    seconds: Array
    """Least time at the valves' flow, s a metre."""


def _travel(machine: Machine) -> tuple[_Travel, _Travel]:
    """Of a way up the slope (rotation and radial joint together), and of one away from it (vertical
    joint).
    """
    rotation, radial, vertical = list(machine.axes.values())[:3]
    legs = machine.legs
    reach_m = legs.radial_offset_m + 0.5 * (
        machine.joints.radial.lower_m + machine.joints.radial.upper_m
    )
    linkages = Linkages.from_machine(machine)
    arms = linkages.rods(linkages.limits.mean(axis=1))[1][:3]
    direction = legs.radial_direction_rad
    ways = arms * np.array([abs(np.sin(direction)) / reach_m, abs(np.cos(direction)), 1.0])
    axes = rotation, radial, vertical
    areas = np.array([axis.cylinder.areas_m2[0] for axis in axes])
    rods = np.array([np.pi / 4 * axis.cylinder.rod_m**2 for axis in axes])
    flows = np.array([axis.rated_flow_m3_s for axis in axes])
    flows[0] *= min(margin_share(machine.power_unit, rotation), 1.0)
    volume, seconds = ways * (2.0 * areas - rods), ways * areas / flows
    return _Travel(volume[:2], seconds[:2]), _Travel(volume[2:], seconds[2:])


def _hauled_m_s(machine: Machine) -> float:
    """Mean speed of a traction device that hauls without a pause, its ways back and clamps counted,
    m/s.
    """
    traction = machine.traction
    stroke = traction.stroke_m - RESERVE_M
    back = stroke / traction.return_speed_m_s + 2.0 * traction.clamp_s
    return stroke / (stroke / traction.speed_max_m_s + back)
