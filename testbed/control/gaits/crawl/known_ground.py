"""What a walk knows of the ground ahead: where one foot has stood, another one follows.

On a straight way the rear feet follow the front ones. What a front foot has found tells where a
rear one will meet the ground, so it need not be lifted over steps nor seek the ground as if nobody
had been there. Places and heights are of the path frame, m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from testbed.formats.arrays import Array

PRINT_WIDTH_M = 0.1
"""A footprint further than this from a foot's own track says nothing of the ground there (E)."""


@dataclass(frozen=True)
class ExpectedGround:
    """What is expected of the ground at a foot's next place."""

    height_m: float
    """Where it is sought."""
    steps_m: float
    """It may lie so much higher."""


class KnownGround:
    """Footprints of a walk: places (3) at which feet have carried, the last one last."""

    def __init__(self, ground_steps_m: float) -> None:
        """ground_steps_m: largest step of the ground between footholds a stride apart; with 0 every
        foothold is as high as the one before, and footprints tell nothing new.
        """
        self._steps_m = ground_steps_m
        self._prints = np.zeros((0, 3))

    def stood(self, foot: Array) -> None:
        """A foot has carried at `foot` (3)."""
        self._prints = np.vstack([self._prints, foot])

    def expected(self, place: Array, ahead: Array, stride_m: float) -> ExpectedGround:
        """The ground at `place` (3), whose height is that of the foot's last foothold: by the
        footprints before and behind it where one is nearer than a stride, else the same again.
        """
        away = (self._prints - place)[:, :2]
        along_m, beside_m = away @ ahead[:2], np.abs(away @ [-ahead[1], ahead[0]])
        track = np.flatnonzero(beside_m <= PRINT_WIDTH_M)
        track = track[np.argsort(along_m[track], kind="stable")]
        nearest_m = float(np.hypot(*away[track].T).min(initial=stride_m))
        if self._steps_m == 0.0 or nearest_m >= stride_m:
            return ExpectedGround(float(place[2]), self._steps_m)
        height_m = float(np.interp(0.0, along_m[track], self._prints[track, 2]))
        return ExpectedGround(height_m, self._steps_m * nearest_m / stride_m)
