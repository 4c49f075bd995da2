"""What noise and ripple leave in pressures at the edges of a recording's bins.

Many samples average both. Where they come so rarely that the ripple of pump and pulses looks like
something slow, a recording cannot say how much of it is there, and a sound machine's oil would seem
to go where there is none.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.bins import Frame
from testbed.diagnosis.robot.tolerances import middle, standard_deviation
from testbed.machine.model import Axis

Array = npt.NDArray[np.float64]
RIPPLE = "axes.*.sensor.pressure_ripple_pa"


def flicker_pa(axis: Axis, pressure_pa: Array, frame: Frame) -> float:
    """Standard deviation of a pressure (samples,) at the bins' edges: by noise, and by ripple
    where samples are too rare to average it: by all that a machine may have, as no recording tells
    what its transducers let through.
    """
    sensor, noise_pa = axis.sensor, frame.noise_at_edges(pressure_pa)
    if not frame.takes_for_slow(sensor.pressure_ripple_hz):
        return noise_pa
    declared = sensor.pressure_ripple_pa
    ripple_pa = np.hypot(middle(RIPPLE, declared), standard_deviation(RIPPLE, declared))
    return float(np.hypot(noise_pa, ripple_pa))


def of_shared_edges(sd: Array) -> Array:
    """Covariance (n, n) of differences between bins' edges that err by `sd` (n,) each: neighbours
    share one.
    """
    shared = np.eye(len(sd)) * 2.0 - np.eye(len(sd), k=1) - np.eye(len(sd), k=-1)
    return np.asarray(shared * np.outer(sd, sd))
