"""Where the ropes lead: surveyed at the start, and followed by the way that the legs have walked
since.

A rope of 30 m turns by up to two degrees with each metre climbed, and a degree is half a kilonewton
of load on the feet. The legs know the way: a foot that stands stays where it is, so the body has
gone by as much as its standing feet have come back. While the same feet stand the sum of these ways
does not wander; at a change of feet it takes up what an encoder is off, a millimetre or two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.formats.records import SET, Record, Records, quantity
from testbed.machine.names import LEGS, SIDES
from testbed.robot.loads.foot_forces import XYZ


@dataclass(frozen=True, eq=False)
class SurveyedRopes:
    """The ropes as surveyed with the machine at its start.

    directions: unit vectors (2, 3) from the traction devices to the anchors, in a frame that does
    not move; zeros where there are no ropes. distances_m (2,): how far away the anchors are;
    infinite where nobody knows, and the rope is then taken not to turn.
    """

    directions: Array
    distances_m: Array

    @classmethod
    def along(cls, ways_m: Array) -> SurveyedRopes:
        """From vectors (2, 3) from the traction devices to the anchors, m."""
        distances = np.linalg.norm(ways_m, axis=1)
        directions = ways_m / np.where(distances > 0.0, distances, 1.0)[:, None]
        return cls(directions, np.where(distances > 0.0, distances, np.inf))

    @classmethod
    def leading(cls, directions: Array, distances_m: Array | None = None) -> SurveyedRopes:
        """From unit vectors (2, 3) and, where somebody knows them, distances (2,), m."""
        unknown = np.full(len(SIDES), np.inf)
        return cls(directions, unknown if distances_m is None else distances_m)

    @classmethod
    def of_table(cls, table: Array) -> SurveyedRopes:
        """From what `table` gave."""
        return cls(table[:, :-1], table[:, -1])

    @property
    def table(self) -> Array:
        """(2, 4) directions and distances, side by side."""
        return np.column_stack([self.directions, self.distances_m])

    def turned(self, rotation: Array) -> SurveyedRopes:
        """The same in another frame; rotation (3, 3): from this one to that."""
        return SurveyedRopes(self.directions @ rotation.T, self.distances_m)


NO_ROPES = SurveyedRopes.along(np.zeros((len(SIDES), 3)))
"""The survey of a machine that hangs on nothing."""


class Bearings:
    """Follows surveyed ropes from Python; compiled code calls `follow`."""

    def __init__(self, ropes: SurveyedRopes) -> None:
        self._ropes, self._state = ropes, RopeBearings.zeros()

    def directions(self, feet: Array, stands: Array) -> Array:
        """Unit vectors (2, 3) towards the anchors now. feet (4, 3), m, stands (4): see follow."""
        ropes = self._ropes
        _follow_first(ropes.directions, ropes.distances_m, feet, stands, self._state)
        return np.array(self._state["direction"][0])


class RopeBearings(Record):
    """Where the ropes lead by now. The frame is that of the survey."""

    direction = quantity("1", "towards the anchors", per=(SIDES, XYZ))
    way = quantity("m", "of the body since the start", per=XYZ)
    foot = quantity("m", "feet from the body's origin when last looked at", per=(LEGS, XYZ))
    stood = quantity("1", "0/1: the foot stood then", per=LEGS)
    begun = quantity("1", "0/1: the feet have been looked at")


@njit
def follow(
    directions: Array, distances: Array, feet: Array, stands: Array, bearings: RopeBearings
) -> None:
    """Bring `bearings` up to date.

    directions (2, 3), distances (2), m: see SurveyedRopes. feet (4, 3), m: from the body's origin,
    in the frame of the survey; stands (4), 0 or 1: which of them stand. A foot whose place is
    unknown (not a number) is left out.
    """
    gone, count = np.zeros(3), 0
    for leg in range(feet.shape[0]):
        known = math.isfinite(feet[leg, 0] + feet[leg, 1] + feet[leg, 2])
        stood = known and stands[leg] > SET
        if stood and bearings.stood[leg] > SET and bearings.begun > SET:
            count += 1
            for axis in range(3):
                gone[axis] += bearings.foot[leg, axis] - feet[leg, axis]
        bearings.stood[leg] = 1.0 if stood else 0.0
        for axis in range(3):
            bearings.foot[leg, axis] = feet[leg, axis]
    bearings.begun = 1.0
    for axis in range(3):
        bearings.way[axis] += gone[axis] / max(count, 1)
    for rope in range(directions.shape[0]):
        square = 0.0
        for axis in range(3):
            along = directions[rope, axis] - bearings.way[axis] / distances[rope]
            bearings.direction[rope, axis] = along
            square += along * along
        if directions[rope, 0] == directions[rope, 1] == directions[rope, 2] == 0.0:
            square = math.inf  # there is no rope
        for axis in range(3):
            bearings.direction[rope, axis] /= math.sqrt(square)


@njit
def _follow_first(
    directions: Array, distances: Array, feet: Array, stands: Array, bearings: Records[RopeBearings]
) -> None:
    """`follow` for an array of one: a single record costs a caller in Python memory."""
    follow(directions, distances, feet, stands, bearings[0])
