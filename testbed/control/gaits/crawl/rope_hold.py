"""Rope traction of a walking robot: haul with the body's motion, and keep the pull along the slope.

The ropes' directions change as the robot climbs towards the anchors and walks across. What is kept
is the force along the slope with which they held the robot at the start: two tensions for its two
components. A rope that would have to push for that is left slack.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.machine.scale import ROBOCLIMBER, Scale

TENSION_GAIN_M_S_N = 6.0e-6
"""Pay-out speed per newton above the wanted tension: with 330 kN/m of rope a loop of 2 1/s (E)."""
CORRECTION_M_S = 0.0018
"""Fastest hauling or paying out for the tension's sake (E): slow enough that a traction device
takes it for rest and goes back for its next stroke, and that little is owed to the rope when it
has."""
MEETING = 0.01
"""Ropes that meet at less than this angle, rad, have no say in the pull across the slope."""
SLACK_SHARE = 0.80
"""Share of its wanted tension that a rope must have before the body moves at all (E)."""
TAUT_SHARE = 0.92
"""Share of it that a rope must have before the body moves at full speed (E)."""
FIRM_SHARE = 1.12
"""Above this share the body slows down: the rope's device cannot pay out just then (E)."""
TIGHT_SHARE = 1.30
"""Above this share the body waits (E)."""
THREE_FEET = 0.4
"""On three feet tensions may differ from what is wanted by so much of that alone (E): ropes that
pull unequally tip the body towards the foot in the air.
"""
TRIM_MOST = 0.04
"""Ropes pull more or less by at most this share to bring the load to the middle of the feet (E)."""


NOTHING = np.zeros(2)
NOTHING.flags.writeable = False


class TensionGains(NamedTuple):
    """How tensions are kept while the body moves."""

    gain_m_s_n: float
    most_m_s: float


@dataclass
class RopeHold:
    """anchors_m (2, 3), left and right: in the path frame, as surveyed; attachments_m (2, 3): on
    the body.
    """

    anchors_m: Array
    attachments_m: Array
    tension_n: Array
    """(2,) at the start; zeros: no ropes."""
    scale: Scale = ROBOCLIMBER
    shared: bool = False
    """Whether somebody else says how the ropes share the pull: here they are only hauled with the
    body, which waits for what both lack together."""

    def __post_init__(self) -> None:
        self._any = bool(self.tension_n.any())
        speed = self.scale.speed
        gain_m_s_n = 0.0 if self.shared else speed / self.scale.force * TENSION_GAIN_M_S_N
        self._keeping = TensionGains(gain_m_s_n, speed * CORRECTION_M_S)
        self.ways_m: Array = self.anchors_m - self.attachments_m
        """(2, 3) from attachments to anchors with the body at the start."""
        self.pull_n: Array = (self.tension_n @ self.directions(np.zeros(3)))[:2]
        """(2,) what is kept: the pull along the slope."""

    def turned(self, share: float) -> RopeHold:
        """The same ropes with the anchors turned about the body's z axis to a share of their
        azimuth, their pull too.
        """
        x, y, _ = self.anchors_m.mean(axis=0)
        turn = (share - 1.0) * math.atan2(y, x)
        c, s = math.cos(turn), math.sin(turn)
        rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return replace(self, anchors_m=self.anchors_m @ rotation.T)

    def trimmed(self, offset_m: Array, feet: Array, carried_n: float) -> tuple[RopeHold, Array]:
        """The same ropes with a pull along the slope by which the load of the `feet` (4, 3) comes
        back by offset_m (2,), path frame, m; and how far (2,) it comes back.

        The feet hold by friction what the ropes pull more or less above them, which turns the body.
        No more than TRIM_MOST of the pull is asked for.
        """
        by_m = float(self.attachments_m[:, 2].mean() - feet[:, 2].mean()) / carried_n
        more_n, most_n = -offset_m / by_m, TRIM_MOST * float(np.hypot(*self.pull_n))
        more_n = more_n * min(1.0, most_n / max(float(np.hypot(*more_n)), 1e-9))
        tensions = wanted_tensions(self.directions(np.zeros(3)), self.pull_n + more_n)
        trimmed = replace(self, tension_n=np.array(tensions))
        return trimmed, by_m * (self.pull_n - trimmed.pull_n)

    def draws_aside_m(self, feet: Array, carried_n: float) -> float:
        """How far to the side (y) the ropes' pull above the `feet` (4, 3) draws the load that they
        carry, path frame, m, were there no limit to it.
        """
        nowhere = np.zeros(3)
        pull_n = float(self.wanted_n(nowhere) @ self.directions(nowhere)[:, 1])
        return pull_n * float(self.attachments_m[:, 2].mean() - feet[:, 2].mean()) / carried_n

    def lengths_m(self, body: Array) -> Array:
        """(2,) from attachment to anchor with the body at `body` (3), path frame."""
        return np.asarray(np.linalg.norm(self.anchors_m - self.attachments_m - body, axis=1))

    def directions(self, body: Array) -> Array:
        """(2, 3) unit vectors towards the anchors, path frame."""
        out = np.empty((2, 3))
        rope_directions(self.ways_m, body, out)
        return out

    def wanted_n(self, body: Array) -> Array:
        """(2,) tensions that keep the pull along the slope."""
        return np.array(self._wanted(body))

    def rates_m_s(
        self, body: Array, before: Array, dt: float, measured_n: Array, owed_n: Array = NOTHING
    ) -> Array:
        """(2) rates of the unstrained lengths (negative hauls in); body (3), before (3) dt s
        ago; owed_n (2): tension that comes by itself, of rope that the devices have still to haul.
        """
        out = np.zeros(2)
        if self._any:
            measured_n = measured_n + owed_n
            ways, pull, by = self.ways_m, self.pull_n, self._keeping
            rope_rates(ways, pull, body, before, dt, measured_n, by, out)
        return out

    def readiness(self, body: Array, measured_n: Array, part: float = 1.0) -> float:
        """0 to 1: how fast the body may move for the ropes' sake, whose tensions may differ from
        what is wanted by a `part` of the usual.
        """
        if not self._any:
            return 1.0
        ways, pull, shared = self.ways_m, self.pull_n, self.shared
        return rope_readiness(ways, pull, body, measured_n, part, shared)

    def _wanted(self, body: Array) -> tuple[float, float]:
        if not self._any:
            return 0.0, 0.0
        return wanted_at(self.ways_m, self.pull_n, body)


@njit
def rope_directions(ways: Array, body: Array, out: Array) -> None:
    """Fill `out` (2, 3) by unit vectors towards the anchors with the body at `body` (3)."""
    for index in range(ways.shape[0]):
        x, y, z = ways[index, 0] - body[0], ways[index, 1] - body[1], ways[index, 2] - body[2]
        length = math.sqrt(x * x + y * y + z * z)
        out[index, 0], out[index, 1], out[index, 2] = x / length, y / length, z / length


@njit
def wanted_tensions(directions: Array, pull: Array) -> tuple[float, float]:
    """Tensions, N, of ropes along `directions` (2, 3) whose pull along the slope is `pull` (2)."""
    lx, ly, rx, ry = directions[0, 0], directions[0, 1], directions[1, 0], directions[1, 1]
    px, py = pull[0], pull[1]
    det = lx * ry - rx * ly
    if abs(det) < MEETING:  # the ropes run side by side: they share the pull
        shared = max(px / (lx + rx), 0.0)
        return shared, shared
    left, right = (px * ry - rx * py) / det, (lx * py - px * ly) / det
    if min(left, right) >= 0.0:
        return left, right
    # one rope cannot do it: the other keeps the pull up the slope as far as it can
    return (
        (max(lx * px + ly * py, 0.0), 0.0) if left >= right else (0.0, max(rx * px + ry * py, 0.0))
    )


@njit
def wanted_at(ways: Array, pull: Array, body: Array) -> tuple[float, float]:
    """Wanted tensions, N, with the body at `body` (3)."""
    directions = np.empty((2, 3))
    rope_directions(ways, body, directions)
    left, right = wanted_tensions(directions, pull)
    return left, right


@njit
def rope_readiness(
    ways: Array, pull: Array, body: Array, measured_n: Array, part: float, shared: bool
) -> float:
    """See RopeHold.readiness."""
    if shared:
        least = most = pull_share(ways, pull, body, measured_n)
    else:
        least, most, wanted = np.inf, -np.inf, wanted_at(ways, pull, body)
        for index in range(2):
            if wanted[index] > 0.0:
                share = measured_n[index] / wanted[index]
                least, most = min(least, share), max(most, share)
    least, most = 1.0 + (least - 1.0) / part, 1.0 + (most - 1.0) / part
    slack = (least - SLACK_SHARE) / (TAUT_SHARE - SLACK_SHARE)
    tight = (TIGHT_SHARE - most) / (TIGHT_SHARE - FIRM_SHARE)
    return min(max(min(slack, tight), 0.0), 1.0)


@njit
def pull_share(ways: Array, pull: Array, body: Array, measured_n: Array) -> float:
    """How much of the wanted `pull` (2) along the slope both ropes have together, 1."""
    directions = np.empty((2, 3))
    rope_directions(ways, body, directions)
    along = 0.0
    for index in range(2):
        onto = directions[index, 0] * pull[0] + directions[index, 1] * pull[1]
        along += measured_n[index] * onto
    return float(along / (pull[0] * pull[0] + pull[1] * pull[1]))


@njit
def rope_rates(
    ways: Array,
    pull: Array,
    body: Array,
    before: Array,
    dt: float,
    measured_n: Array,
    by: TensionGains,
    out: Array,
) -> None:
    """See RopeHold.rates_m_s."""
    directions = np.empty((2, 3))
    rope_directions(ways, body, directions)
    wanted = wanted_tensions(directions, pull)
    vx, vy, vz = (body[0] - before[0]) / dt, (body[1] - before[1]) / dt, (body[2] - before[2]) / dt
    for index in range(2):
        excess = min(
            max(by.gain_m_s_n * (measured_n[index] - wanted[index]), -by.most_m_s), by.most_m_s
        )
        out[index] = excess - (
            directions[index, 0] * vx + directions[index, 1] * vy + directions[index, 2] * vz
        )
