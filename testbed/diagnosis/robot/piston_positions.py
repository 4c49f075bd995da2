"""Where a piston is at the edges of bins, as far as its encoder shows: counts that round, joints
that play.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.bins import EDGE_S, Bins
from testbed.diagnosis.robot.motion_noise import slides_surely
from testbed.diagnosis.robot.tolerances import standard_deviation
from testbed.machine.model import Axis

Array = npt.NDArray[np.float64]
PLAY_S = 0.5
"""In about this time a joint goes from one place within its play to another while it rests or turns
round; ROBOCLIMBER's (E).
"""
HUNTING = 1.5
"""Joints that hunt within their play are those that have much of it, and go from end to end (E)."""
DRAGS = 0.5
"""A joint that slides as surely as that drags its encoder along (E)."""
STILL_SHARE = 0.15
"""Share of an encoder's rounding that is left between two edges at which it reads the same (E)."""


def rounding(bins: Bins, i: int, axis: Axis) -> Array:
    """(n + 1,) m, standard deviation of the encoder's rounding at the edges of the bins.

    A piston that hardly moves is anywhere within a count; one that passes several counts while its
    place is taken averages them; one that stands still errs alike at both edges.
    """
    count_m = axis.encoder_count * np.abs(_at_edges(bins.arm_m[:, i]))
    speed = np.abs(bins.speed_m_s[:, i])
    passed = np.maximum(_at_edges(speed) * EDGE_S / count_m, 1.0)
    still = _at_edges(speed) == 0.0
    return np.asarray(count_m / np.sqrt(12.0) / passed * np.where(still, STILL_SHARE, 1.0))


def play(bins: Bins, i: int, axis: Axis) -> Array:
    """(3, n + 1) m, standard deviation of where a joint is within its play at the edges of the
    bins: where it rests or hunts; where it turns round, from end to end; and where it begins or
    ends a slide: it crosses its play before its encoder follows.
    """
    if axis.joint != "rotation":
        return np.zeros((3, bins.count + 1))
    sd = HUNTING * standard_deviation("joint.play@*.half_width")
    surely = slides_surely(bins.direction[:, i, None])[:, 0]
    before, after = np.append(surely[:1], surely), np.append(surely, surely[-1:])
    rests = 1.0 - np.minimum(before, after)
    way = np.sign(bins.direction[:, i])
    index = np.arange(bins.count)
    last = np.maximum.accumulate(np.where(way != 0.0, index, 0))
    following = np.minimum.accumulate(np.where(way != 0.0, index, bins.count - 1)[::-1])[::-1]
    turns = np.append(way[:1], way[last]) * np.append(way[following], way[-1:]) < 0.0
    begins = np.abs(after - before)
    return np.asarray(sd * np.abs(_at_edges(bins.arm_m[:, i])) * np.array([rests, turns, begins]))


def lies_in_play(direction: Array) -> tuple[Array, Array]:
    """At which end of its play each of k joints lies that slides like that, (n, k) -1 to 1, and how
    unsure that is, (n, k) 0 to 1.

    An encoder that is dragged along lies behind its joint; at rest and while it turns round the
    joint goes from one end to the other unseen.
    """
    surely = slides_surely(direction)
    way = np.where(surely > DRAGS, np.sign(direction), 0.0)
    index = np.arange(len(direction))[:, None]
    last = np.maximum.accumulate(np.where(way != 0.0, index, 0))
    return np.take_along_axis(way, last, axis=0), 1.0 - surely


def _at_edges(values: Array) -> Array:
    """Values (n,) of bins as means (n + 1,) over the two bins beside each edge."""
    padded = np.concatenate([values[:1], values, values[-1:]])
    return np.asarray(0.5 * (padded[:-1] + padded[1:]))


def swept(areas_m2: Array, places: Array) -> Array:
    """Covariance (2 n, 2 n) of the flows into chambers of these areas (2,) that go with places
    (n + 1, n + 1) of the piston at the bins' edges, by a bin's length squared, m2/s2: what it
    sweeps in a bin goes from one to the next.
    """
    speeds = np.diff(np.diff(places, axis=0), axis=1)
    return np.asarray(np.kron(np.outer(areas_m2, areas_m2), speeds), dtype=np.float64)


def rounded(rounding_m: Array, time_s: Array) -> Array:
    """Covariance (n + 1, n + 1) of the encoder's rounding, by the bins' length squared, m2/s2."""
    return np.diag(rounding_m**2) / _step(time_s) ** 2


def played(play_m: Array, time_s: Array, crosses_s: float) -> Array:
    """The same of the piston's place within its joint's play, (3, n + 1) as `play` gives it, which
    it crosses in about `crosses_s`; within a bin where a slide begins or ends.
    """
    edges, step = np.arange(len(time_s) + 1), _step(time_s)
    apart = step * np.abs(np.subtract.outer(edges, edges)) / crosses_s
    goes = np.exp(-apart)
    creeps = (1.0 + apart) * goes  # with a speed that lasts
    resting, turning, beginning = (np.outer(off, off) for off in play_m)
    at_once = np.eye(len(edges))
    return np.asarray((creeps * resting + goes * turning + at_once * beginning) / step**2)


def wanders(time_s: Array) -> Array:
    """Correlation (n, n) of where a joint is within its play at these times while it rests."""
    return np.asarray(np.exp(-np.abs(np.subtract.outer(time_s, time_s)) / PLAY_S))


def _step(time_s: Array) -> float:
    return float(np.median(np.diff(time_s)))
