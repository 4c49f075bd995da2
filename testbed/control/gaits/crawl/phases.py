"""The pieces that a walk is made of."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from testbed.control.gaits.crawl.swing import Swing

Array = NDArray[np.float64]


class Doing(Enum):
    """What the robot is at."""

    SHIFT = "shift"
    """All feet stand; the body moves."""
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


@dataclass
class Phase:
    """One piece of the walk. Places are (3,) in the path frame, m."""

    doing: Doing
    duration_s: float
    body_from: Array
    body_to: Array
    leg: int = -1
    swing: Swing | None = None
    old_m: float = 0.0
    """Height of the old foothold, path frame: a search begins above it and ends below it."""
    tries: int = 1
    """Which search for this foothold it is, or was before this seat."""
    travels: bool = field(init=False)
    """Whether the body moves."""
    ends: list[tuple[float, float]] = field(init=False)
    """The body's start and end along x, y and z."""

    def __post_init__(self) -> None:
        """Work out what follows from the places."""
        self.ends = list(zip(self.body_from.tolist(), self.body_to.tolist(), strict=True))
        self.travels = any(start != end for start, end in self.ends)
