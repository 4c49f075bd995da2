"""How fast set points may move: what valves, pump and traction devices can do on a planned way.

A way is sampled, and its duration is the shortest at which no joint, no rope and not the pump is
asked for more than its limit. Progress along it is a trapezoid of speed: rest, ramp, cruise, ramp.
"""

from __future__ import annotations

import numpy as np

from testbed.formats.arrays import Array
from testbed.machine.groups import PowerUnit
from testbed.machine.model import Axis, Machine
from testbed.machine.names import ROTATION

RAMP = 0.12
"""Share of a way's time in which its speed rises, and falls."""
PEAK = 1.0 / (1.0 - RAMP)
"""Highest speed relative to the mean."""
SWING_RAMP = 0.2
"""The usual such share for each part of a swing: a leg that sets off or stops too hard lifts the
foot across from it.
"""
LOADED_SHARE = 0.85
"""Share of a valve's flow at its rated drop that set points of a leg in stance may ask for (E): the
rest is the loops' reserve."""
FREE_SHARE = 0.95
"""Share of that flow for a leg in the air (E)."""
PUMP_SHARE = 0.8
"""Share of the pump's full flow that set points may ask for (E)."""
TRACTION_SHARE = 0.9
"""Share of a traction device's speed that the body's motion may ask for (E): the rest is for the
tension's sake.
"""


class Pace:
    """Limits of one machine: cylinder flows (12), traction speed and the pump's flow."""

    def __init__(self, machine: Machine, arms: Array) -> None:
        """`arms` (12): of the cylinders at the start, m/rad or 1."""
        axes = list(machine.axes.values())
        areas = np.array([axis.cylinder.areas_m2[0] for axis in axes])
        self._volume = areas * arms
        rods = np.array([axis.cylinder.rod_m / axis.cylinder.bore_m for axis in axes])
        self._back = 1.0 - rods**2
        """(12) oil that a way back takes from the pump, by that of a way out."""
        self._rated = np.array([axis.rated_flow_m3_s for axis in axes])
        self._free = FREE_SHARE * self._rated
        """(12) m3/s that a leg in the air may ask for. One that turns uphill may carry the highest
        load of all: its valve has no more than the supply's margin.
        """
        for axis in ROTATION:
            self._free[axis] *= min(margin_share(machine.power_unit, axes[axis]), 1.0)
        self._pump = PUMP_SHARE * machine.power_unit.full_flow_m3_s
        self._traction_area = machine.traction.piston_area_m2
        self._traction_m_s = TRACTION_SHARE * machine.traction.speed_max_m_s
        self.haste = 1.0
        """So many times the usual share of pump and valves may be asked for, 1.4 times all of them;
        of a traction device no more than its speed."""

    def shift_s(self, joints: Array, ropes_m: Array, ramp: float = RAMP) -> float:
        """Least duration of a shift of the body, sampled evenly: joints (n, 12), rope lengths (n,
        2) to be kept, m; its speed rises and falls in a share `ramp` of it.
        """
        return 1.0 / (1.0 - ramp) * self._needed_s(joints, ropes_m, LOADED_SHARE * self._rated)

    def swing_s(self, joints: Array) -> float:
        """Least duration of a leg's swing, sampled evenly in time: joints (n, 12)."""
        return self._needed_s(joints, np.zeros((len(joints), 2)), self._free)

    def free_s(self, axis: int, change: float, ramp: float = SWING_RAMP) -> float:
        """Least duration of a move by `change` (rad or m) of one joint of a leg in the air, whose
        speed rises and falls in this share of it.
        """
        return (
            abs(change)
            / (1.0 - ramp)
            * float(self._volume[axis] / self._free[axis])
            / min(self.haste, 1.0)
        )

    def _needed_s(self, joints: Array, ropes_m: Array, flows: Array) -> float:
        count = len(joints) - 1
        ways = np.diff(joints, axis=0)
        oil = np.abs(ways) * self._volume * count
        rope = np.diff(ropes_m, axis=0) * count
        hauled = np.maximum(-rope, 0.0) * self._traction_area
        pump = (oil * np.where(ways > 0.0, 1.0, self._back)).sum(axis=1) + hauled.sum(axis=1)
        haste, of_rope = self.haste, min(self.haste, 1.0 / TRACTION_SHARE)
        needs = (
            oil / (haste * flows),
            np.abs(rope) / (of_rope * self._traction_m_s),
            pump / (haste * self._pump),
        )
        return max(float(need.max()) for need in needs)


def margin_share(unit: PowerUnit, axis: Axis) -> float:
    """Share of its rated flow that a valve lets through against the highest load of all, in its
    slower direction: what is left of a load-sensing supply for its edge is the margin. Other
    supplies: 1.
    """
    if not unit.load_sensing:
        return 1.0
    valve, back = axis.valve, 1.0 - (axis.cylinder.rod_m / axis.cylinder.bore_m) ** 2
    edge = min(valve.edge_pa, valve.edge_pb / back)
    return edge * float(np.sqrt(unit.load_sensing_margin_pa / valve.rated_drop_per_edge_pa))


def progress(share: float, ramp: float = RAMP) -> float:
    """Share of the way covered at a share of its time: a trapezoid of speed with ramps of
    `ramp`.
    """
    t, peak = min(max(share, 0.0), 1.0), 1.0 / (1.0 - ramp)
    if t < ramp:
        return 0.5 * peak * t * t / ramp
    if t > 1.0 - ramp:
        return 1.0 - 0.5 * peak * (1.0 - t) ** 2 / ramp
    return peak * (t - 0.5 * ramp)
