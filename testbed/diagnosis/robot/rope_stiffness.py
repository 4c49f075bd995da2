"""How stiff the ropes seem: while a traction device changes its grip its clamp holds the rope, and
the pull then rises with the way that the body goes down it, as of a spring.

No sensor reads the rope paid out, so only those stretches are looked at in which the pull rises
along a straight line over the body's way: a device that pays out as it is asked to keeps the pull.
A device that pays out too slowly looks like a soft rope for a while, and one that hauls a slack
rope in like a stiff one, each time by as much as it happens to do. A clamp holds for a change of
grip: a stretch that lasts about that long is the rope's, a longer one is none, and a shorter one
says little, but may agree. Of several stiffnesses in which stretches agree that one counts which
most stretches show that last.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.bins import Bins
from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.hauling import along_ropes, grip_change_s
from testbed.machine.groups import Traction
from testbed.machine.scale import Scale
from testbed.robot.robot import Robot

Array = npt.NDArray[np.float64]
LEAST_BINS = 6
LEAST_M, LEAST_N = 8.0e-3, 1000.0
"""A shorter way, or a smaller rise of the pull, is the lag of position loops (E)."""
STRAIGHT_SHARE, STRAIGHT_N = 0.04, 40.0
"""RMS by which a stretch may leave its straight line: a share of the rise, and noise (E)."""
EDGES_S = 0.25
"""A stretch may seem longer than a clamp holds by the bins at its edges: those of 35 sways of sound
ropes last up to 2.1 s, by 35 ms longer than a change of grip (B).
"""
FEWEST = 2
"""So many stretches must show it."""
SEEMS = 0.95
"""Stiffness that ropes of sound machines seem to have by what is declared: feet, ground and play
give, too; the mean of 40 sways of drawn machines, 0.86 to 1.08 (B).
"""
EACH, ALL = 0.12, 0.06
"""Standard deviation of it from stretch to stretch, and of all together (B)."""
LASTS, SHORT = 0.7, 0.3
"""Share of a change of grip from which a stretch is surely a clamp's, and the standard deviation of
shorter ones (B: of 361 stretches of 97 sound recordings 93 % of those that last so long, and 57 %
of shorter ones, are within a quarter of the rope's stiffness).
"""
SOFTEST = 0.2
"""No rope is as soft as this share of what is declared: a pull that rises so slowly is that of a
device which pays out somewhat too slowly (E).
"""
AGREES = 2.0 * 2.0**0.5 * EACH
"""Two stretches of one rope hardly differ by more than this share: two standard deviations of their
difference.
"""


@dataclass(frozen=True, eq=False)
class HeldRopes:
    """Stretches of a recording in which a rope was held, k of them."""

    time_s: Array
    """(k,) when each begins."""
    stiffness: Array
    """(k,) by what is declared."""
    lasts: npt.NDArray[np.bool_]
    """(k,) whether it lasts about as long as a change of grip."""

    @classmethod
    def none(cls) -> HeldRopes:
        """No rope was held, or nobody knows how stiff they should be."""
        return cls(np.zeros(0), np.zeros(0), np.zeros(0, dtype=bool))

    @property
    def shown(self) -> bool:
        """Whether they say anything of the ropes."""
        return len(self.stiffness) >= FEWEST and bool(self.lasts.any())

    def group(self) -> RawGroup:
        """The group `ropes`: how much stiffer each stretch seems than ropes as declared."""
        rows = len(self.stiffness)
        return RawGroup(
            missing=self.stiffness / SEEMS - 1.0,
            time_s=self.time_s,
            noise=np.diag(np.where(self.lasts, EACH, SHORT) ** 2),
            tolerated=np.full((rows, 1), ALL),
            rows_of=lambda change: np.full(rows, change.ropes),
        )


def held_ropes(bins: Bins, robot: Robot, ropes_in_world: Array) -> HeldRopes:
    """What a recording shows of the ropes; `ropes_in_world` (2, 3) as surveyed."""
    declared = robot.rope_stiffness_n_m
    if declared is None:
        return HeldRopes.none()
    step_s = float(np.median(np.diff(bins.time_s)))
    down_m = -np.cumsum(along_ropes(bins, robot, ropes_in_world), axis=0) * step_s
    found = [
        (bins.time_s[first], count * step_s, slope / declared)
        for way, pull in zip(down_m.T, bins.tension_n.T, strict=True)
        for first, count, slope in _stretches(way, pull, robot.machine.scale)
        if _is_a_clamp(count * step_s, slope / declared, robot.machine.traction)
    ]
    if not found:
        return HeldRopes.none()
    time, lasts_s, stiffness = np.array(found).T
    lasts = lasts_s >= LASTS * grip_change_s(robot.machine.traction)
    same = _agreeing(stiffness, lasts)
    return HeldRopes(time[same], stiffness[same], lasts[same])


def _is_a_clamp(lasts_s: float, stiffness: float, traction: Traction) -> bool:
    """Whether a stretch may be of a rope that is held: no clamp holds it for longer than its device
    needs to go back; what lasts longer, or rises hardly at all by what is declared, is a device
    that pays out or hauls in.
    """
    return stiffness > SOFTEST and lasts_s < grip_change_s(traction) + EDGES_S


def _agreeing(stiffness: Array, lasts: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """(k,) which stretches agree with the one that most of those agree with that last (k,); of two
    such the stiffer one, for devices that are too slow are the more frequent.
    """
    near = np.abs(np.log(stiffness[:, None] / stiffness[None, :])) < AGREES
    order = np.lexsort((stiffness, near @ lasts.astype(int)))
    return np.asarray(near[order[-1]], dtype=bool)


def _stretches(way_m: Array, pull_n: Array, scale: Scale) -> list[tuple[int, int, float]]:
    """(first bin, how many, slope N/m) of the longest stretches of n bins in which a pull (n,)
    rises along a straight line over the body's way down the rope (n,).
    """
    least_m, least_n = scale.length * LEAST_M, scale.times("N") * LEAST_N
    out, first = [], 0
    while first + LEAST_BINS <= len(way_m):
        last, slope = first + LEAST_BINS, 0.0
        for end in range(first + LEAST_BINS, len(way_m) + 1):
            way, pull = way_m[first:end], pull_n[first:end]
            rise = _slope(way, pull)
            off = float(np.std(pull - rise * way))
            if rise <= 0.0 or off > STRAIGHT_SHARE * np.ptp(pull) + STRAIGHT_N * scale.times("N"):
                break
            if np.ptp(way) > least_m and pull[-1] - pull[0] > least_n:
                last, slope = end, rise
        if slope > 0.0:
            out.append((first, last - first, slope))
        first = last - 1 if slope > 0.0 else first + 1
    return out


def _slope(way_m: Array, pull_n: Array) -> float:
    """Of the straight line through pulls (n,) over ways (n,), N/m; 0 where the way is one."""
    about = way_m - way_m.mean()
    spread = float(about @ about)
    return float(about @ pull_n) / spread if spread > 0.0 else 0.0
