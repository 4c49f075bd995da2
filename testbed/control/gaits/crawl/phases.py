"""The pieces that a walk is made of."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from testbed.control.gaits.crawl.pace import progress
from testbed.control.gaits.crawl.swing import Swing
from testbed.formats.arrays import Array


class Doing(Enum):
    """What the robot is at."""

    SHIFT = "shift"
    """All feet stand; the body goes its way to the end."""
    UNLOAD = "unload"
    """A foot is taken off the ground, gently."""
    SWING = "swing"
    """The foot goes over to its next place."""
    SEARCH = "search"
    """The foot is lowered until it meets the ground."""
    SEAT = "seat"
    """The foot is given time to carry."""


IN_THE_AIR = (Doing.UNLOAD, Doing.SWING, Doing.SEARCH)
"""Phases in which the leg is not meant to carry."""


@dataclass(frozen=True)
class BodyWay:
    """A straight way of the body. Places are (3,) in the path frame, m."""

    start: Array
    end: Array
    duration_s: float

    def at(self, t: float) -> Array:
        """(3) where the body is meant to be t seconds after it set off."""
        return np.asarray(self.start + progress(t / self.duration_s) * (self.end - self.start))


@dataclass
class Phase:
    """One piece of the walk."""

    doing: Doing
    duration_s: float
    leg: int = -1
    way: BodyWay | None = None
    """The way that the body sets off on when the phase begins; None: it goes on as it was."""
    swing: Swing | None = None
    old_m: float = 0.0
    """Height of the old foothold, path frame: a search begins above it and ends below it."""
    tries: int = 1
    """Which search for this foothold it is, or was before this seat."""
