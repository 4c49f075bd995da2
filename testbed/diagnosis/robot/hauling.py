"""What the traction devices draw while they haul the machine on its ropes: nobody measures it, but
the feet show how the body goes and the load pins how the ropes stretch.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.bins import Bins
from testbed.robot.attitude import rotation_from_attitude
from testbed.robot.robot import Robot

Array = npt.NDArray[np.float64]
ROPE_M = 30.0
"""Length of a rope, by which it stretches (E)."""
STANDS = 0.5
"""Share of a bin from which on a foot that is meant to carry shows the body's way."""


def hauled_m3_s(bins: Bins, robot: Robot, ropes_in_world: Array) -> Array:
    """(n,) flow into both traction devices that haul; `ropes_in_world` (2, 3) as surveyed."""
    machine = robot.machine
    step_s = float(np.median(np.diff(bins.time_s)))
    stretch = ROPE_M / machine.rope.stiffness_ea_n * np.gradient(bins.tension_n, step_s, axis=0)
    drawn = np.empty(bins.count)
    for k in range(bins.count):
        _, jacobians = robot.model.feet(bins.joint[k])
        feet_m_s = -jacobians @ bins.joint_rate[k]
        stands = bins.carrying[k] > STANDS
        body_m_s = feet_m_s[stands].mean(axis=0) if stands.any() else np.zeros(3)
        ways = ropes_in_world @ rotation_from_attitude(bins.attitude_rad[k])
        drawn[k] = np.maximum(ways @ body_m_s + stretch[k], 0.0).sum()
    return drawn * machine.traction.piston_area_m2
