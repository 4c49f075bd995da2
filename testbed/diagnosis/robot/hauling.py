"""What the traction devices draw while they haul the machine on its ropes: nobody measures it, but
the feet show how the body goes and the load pins how the ropes stretch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.bins import Bins
from testbed.machine.groups import Traction
from testbed.robot.model import rotation_from_attitude
from testbed.robot.robot import Robot

Array = npt.NDArray[np.float64]
ROPE_M = 30.0
"""Length of a rope, by which it stretches (E)."""
STANDS = 0.5
"""Share of a bin from which on a foot that is meant to carry shows the body's way."""


SURELY_M_S = 8.0e-3
"""A body that goes up its ropes faster than this is surely hauled, one that goes down as fast is
surely not (E).
"""
HELD_N, HELD_BINS = 1000.0, 5
"""A rope whose tension changes by so much within so many bins is held by its clamp: its device
changes its grip, or is just about to (E).
"""
HARDLY = 0.2
"""Of HELD_N: what position loops leave of a tension that is regulated (E)."""


@dataclass(frozen=True, eq=False)
class Hauling:
    """What both traction devices ask of the supply in n bins, (n,) each."""

    drawn_m3_s: Array
    load_pa: Array
    """Of those that haul; 0 where none does."""
    unsure: Array
    """0 to 1: how unsure it is whether one hauls; then it would ask for `perhaps_pa`."""
    perhaps_pa: Array
    held: Array
    """0 to 1: how surely a rope is held while its device changes its grip."""
    returning_m3_s: Array
    """What devices may draw that go back for their next stroke."""

    @classmethod
    def none(cls, bins: int) -> Hauling:
        """A machine that does not haul."""
        nothing = np.zeros(bins)
        return cls(nothing, nothing, nothing, nothing, nothing, nothing)


def hauling_of(bins: Bins, robot: Robot, ropes_in_world: Array) -> Hauling:
    """How a recorded machine hauls itself; `ropes_in_world` (2, 3) as surveyed."""
    machine = robot.machine
    step_s = float(np.median(np.diff(bins.time_s)))
    stretch = ROPE_M / machine.rope.stiffness_ea_n * np.gradient(bins.tension_n, step_s, axis=0)
    speed = (along_ropes(bins, robot, ropes_in_world) + stretch) / machine.scale.speed
    area, loads = machine.traction.piston_area_m2, bins.tension_n / machine.traction.piston_area_m2
    unsure = np.clip(1.0 - np.abs(speed) / SURELY_M_S, 0.0, 1.0)
    held = held_of(bins.tension_n / machine.scale.times("N"))
    return Hauling(
        np.maximum(speed * machine.scale.speed, 0.0).sum(axis=1) * area,
        np.where(speed > 0.5 * SURELY_M_S, loads, 0.0).max(axis=1),
        unsure.max(axis=1),
        loads.max(axis=1),
        held.max(axis=1),
        returning(held, machine.traction, step_s),
    )


def held_of(tension_n: Array) -> Array:
    """(n, 2) 0 to 1: how surely each rope is held in n bins, by its tension (n, 2) of
    ROBOCLIMBER.
    """
    index = np.arange(len(tension_n))
    reach = range(-HELD_BINS, HELD_BINS + 1)
    near = np.array([tension_n[np.clip(index + k, 0, len(index) - 1)] for k in reach])
    return np.asarray(np.clip(np.ptp(near, axis=0) / HELD_N - HARDLY, 0.0, 1.0))


def returning(held: Array, traction: Traction, step_s: float) -> Array:
    """(n,) m3/s that devices may draw which go back for their next stroke: each from when its rope
    is held (n, 2) for as long as a change of grip takes. Where the body hardly moves meanwhile the
    tension does not show it.
    """
    lasts = int(np.ceil(grip_change_s(traction) / step_s))
    padded = np.vstack([np.zeros((lasts, held.shape[1])), held])
    begun = [padded[k : k + len(held)] for k in range(lasts + 1)]
    goes_back = np.max(begun, axis=0).sum(axis=1)
    return np.asarray(goes_back * traction.annulus_area_m2 * traction.return_speed_m_s)


def grip_change_s(traction: Traction) -> float:
    """How long a device that goes back for its next stroke holds its rope by its clamp, s."""
    return traction.stroke_m / traction.return_speed_m_s + 2.0 * traction.clamp_s


def along_ropes(bins: Bins, robot: Robot, ropes_in_world: Array) -> Array:
    """(n, 2) m/s at which the body goes towards the ropes' anchors, by the feet that stand;
    `ropes_in_world` (2, 3) as surveyed.
    """
    speed = np.empty_like(bins.tension_n)
    for k in range(bins.count):
        _, jacobians = robot.model.feet(bins.joint[k])
        feet_m_s = -jacobians @ bins.joint_rate[k]
        stands = bins.carrying[k] > STANDS
        body_m_s = feet_m_s[stands].mean(axis=0) if stands.any() else np.zeros(3)
        speed[k] = ropes_in_world @ rotation_from_attitude(bins.attitude_rad[k]) @ body_m_s
    return speed
