"""Where the ropes lead in each bin: as surveyed at the start, and followed by the way of the body
since, where the survey says how long they are.

A body that goes 0.2 m across a rope of 30 m turns it by 7 mrad, as much as a survey may be off.
"""

from __future__ import annotations

import numpy as np

from testbed.diagnosis.robot.bins import Bins
from testbed.formats.arrays import Array
from testbed.robot.robot import Robot
from testbed.robot.rope_bearings import Bearings, SurveyedRopes

STANDS = 0.5
"""Share of a bin from which on a foot that is meant to carry shows the body's way."""


def rope_ways(bins: Bins, robot: Robot, ropes_in_world: Array, rotation: Array) -> Array:
    """Unit vectors (n, 2, 3) towards the anchors, body frame; ropes_in_world (2, 3) as surveyed,
    rotation (n, 3, 3) from the body to the world.
    """
    ropes = np.broadcast_to(ropes_in_world, (bins.count, *ropes_in_world.shape))
    if robot.rope_lengths_m is not None:
        bearings = Bearings(SurveyedRopes(ropes_in_world, robot.rope_lengths_m))
        stands = (bins.carrying > STANDS).astype(float)
        ropes = np.array(
            [
                bearings.directions(robot.model.feet(bins.joint[k])[0] @ rotation[k].T, stands[k])
                for k in range(bins.count)
            ]
        )
    return np.asarray(np.einsum("nrj,njk->nrk", ropes, rotation))
