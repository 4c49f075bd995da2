"""Rope traction of a walking robot: haul with the body's motion, and keep the pull along the slope.

The ropes' directions change as the robot climbs towards the anchors and walks across. What is kept is the force along
the slope with which they held the robot at the start: two tensions for its two components. A rope that would have to
push for that is left slack.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
TENSION_GAIN_M_S_N = 6.0e-6
"""Pay-out speed per newton above the wanted tension: with 330 kN/m of rope a loop of 2 1/s (E)."""
CORRECTION_M_S = 0.0018
"""Fastest hauling or paying out for the tension's sake (E): slow enough that a traction device takes it for rest and
goes back for its next stroke, and that little is owed to the rope when it has."""
MEETING = 0.01
"""Ropes that meet at less than this angle, rad, have no say in the pull across the slope."""
SLACK_SHARE, TAUT_SHARE = 0.80, 0.92
"""Of its wanted tension a rope must have this much before the body moves at all, and at full speed (E)."""
FIRM_SHARE, TIGHT_SHARE = 1.12, 1.30
"""Above the first the body slows down, above the second it waits: its device cannot pay out just then (E)."""


@dataclass
class RopeHold:
    """anchors_m (2, 3), left and right: in the path frame, as surveyed; attachments_m (2, 3): on the body."""

    anchors_m: Array
    attachments_m: Array
    tension_n: Array
    """(2,) at the start; zeros: no ropes."""

    def __post_init__(self) -> None:
        directions = self.directions(np.zeros(3))
        self._pull_n: Array = (self.tension_n @ directions)[:2]

    def lengths_m(self, body: Array) -> Array:
        """(2,) from attachment to anchor with the body at `body` (3), path frame."""
        return np.asarray(np.linalg.norm(self.anchors_m - self.attachments_m - body, axis=1))

    def directions(self, body: Array) -> Array:
        """(2, 3) unit vectors towards the anchors, path frame."""
        way = self.anchors_m - self.attachments_m - body
        return np.asarray(way / np.sqrt((way * way).sum(axis=1))[:, None])

    def wanted_n(self, body: Array) -> Array:
        """(2,) tensions that keep the pull along the slope."""
        if not self.tension_n.any():
            return np.zeros(2)
        (lx, ly, _), (rx, ry, _) = self.directions(body).tolist()
        px, py = self._pull_n.tolist()
        det = lx * ry - rx * ly
        if abs(det) < MEETING:  # the ropes run side by side: they share the pull
            return np.full(2, max(px / (lx + rx), 0.0))
        tension = np.array([(px * ry - rx * py) / det, (lx * py - px * ly) / det])
        if tension.min() < 0.0:  # one rope cannot do it: the other keeps the pull up the slope as far as it can
            taut = int(np.argmax(tension))
            tension = np.zeros(2)
            tension[taut] = max((lx * px + ly * py, rx * px + ry * py)[taut], 0.0)
        return np.asarray(tension)

    def rates_m_s(self, body: Array, velocity: Array, measured_n: Array) -> Array:
        """(2,) rates of the unstrained lengths (negative hauls in) for a body moving at `velocity` (3)."""
        if not self.tension_n.any():
            return np.zeros(2)
        excess = TENSION_GAIN_M_S_N * (measured_n - self.wanted_n(body))
        return np.asarray(-self.directions(body) @ velocity + np.clip(excess, -CORRECTION_M_S, CORRECTION_M_S))

    def readiness(self, body: Array, measured_n: Array) -> float:
        """0 to 1: how fast the body may move for the ropes' sake."""
        wanted = self.wanted_n(body)
        taut = wanted > 0.0
        if not taut.any():
            return 1.0
        shares = measured_n[taut] / wanted[taut]
        slack = (float(shares.min()) - SLACK_SHARE) / (TAUT_SHARE - SLACK_SHARE)
        tight = (TIGHT_SHARE - float(shares.max())) / (TIGHT_SHARE - FIRM_SHARE)
        return min(max(min(slack, tight), 0.0), 1.0)
