"""What noise and ripple leave in pressures at the edges of a recording's bins.

Many samples average both. Where they come so rarely that the ripple of pump and pulses looks like
something slow, a recording cannot say how much of it is there, and a sound machine's oil would seem
to go where there is none.

What effects make of a pressure's change must not be made of that noise: an effect by which a
chamber takes up more would seem to be denied by every bin in which nothing changed.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.ndimage import median_filter

from testbed.diagnosis.robot.bins import Frame
from testbed.diagnosis.robot.tolerances import middle, standard_deviation
from testbed.machine.model import Axis

Array = npt.NDArray[np.float64]
RIPPLE = "axes.*.sensor.pressure_ripple_pa"
ABOUT_BINS = 15
"""So many bins about one show what comes and goes at their edges (E)."""
MEDIAN_OFF = 0.6745 * 1.5**0.5
"""Median by which values that err by one standard deviation each leave the line through their
neighbours.
"""
TOLD_FROM, TOLD_SURELY = 1.0, 2.0
"""A change between a bin's edges of fewer standard deviations of noise is none, and one of more is
one as it is (E).
"""


def flicker_pa(axis: Axis, pressure_pa: Array, frame: Frame) -> Array:
    """(n,) standard deviation of a pressure (samples,) at the bins' edges: by noise, and by ripple
    where samples are too rare to average it: by all that a machine may have, as no recording tells
    what its transducers let through.
    """
    sensor, edges = axis.sensor, frame.at_edges(pressure_pa)
    noise_pa = np.maximum(frame.noise_at_edges(pressure_pa), _restless(edges))
    if not frame.takes_for_slow(sensor.pressure_ripple_hz):
        return noise_pa
    declared = sensor.pressure_ripple_pa
    ripple_pa = np.hypot(middle(RIPPLE, declared), standard_deviation(RIPPLE, declared))
    return np.asarray(np.hypot(noise_pa, ripple_pa))


def _restless(edges: Array) -> Array:
    """(n,) standard deviation of values at the bins' edges (n + 1,) by what comes and goes from
    edge to edge in most bins about each: ripple that beats with the bins lasts longer than a
    sample, and shakes while the machine drills.
    """
    off = np.abs(edges[1:-1] - 0.5 * (edges[:-2] + edges[2:]))
    inside = np.pad(off, (0, 1), "edge") if len(off) else np.zeros(len(edges) - 1)
    return np.asarray(median_filter(inside, ABOUT_BINS, mode="nearest") / MEDIAN_OFF)


def told_share(edges: Array, sd: Array) -> Array:
    """(n,) share, 0 to 1, of the change between the edges of each bin that is one, of values at
    edges (n + 1,) that err by `sd` (n,).
    """
    off = np.sqrt(2.0) * sd
    sizes = np.full(len(off), np.inf)
    np.divide(np.abs(np.diff(edges)), off, out=sizes, where=off > 0.0)
    return np.asarray(np.clip((sizes - TOLD_FROM) / (TOLD_SURELY - TOLD_FROM), 0.0, 1.0))


def of_shared_edges(sd: Array) -> Array:
    """Covariance (n, n) of differences between bins' edges that err by `sd` (n,) each: neighbours
    share one.
    """
    shared = np.eye(len(sd)) * 2.0 - np.eye(len(sd), k=1) - np.eye(len(sd), k=-1)
    return np.asarray(shared * np.outer(sd, sd))
