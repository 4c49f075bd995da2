"""Figure 11: the external force (7) on the sinusoid."""

from __future__ import annotations

import numpy as np

from testbed.benchmarks.estimators.identification_trials import friction_force
from testbed.benchmarks.harness import rms
from testbed.benchmarks.paper.experiment import Line, Result
from testbed.benchmarks.paper.figure_06 import WEIGHT_N, in_the_air
from testbed.benchmarks.paper.figure_08 import identified, velocity
from testbed.benchmarks.paper.leg import Trace
from testbed.estimation.leg.motion import smooth
from testbed.formats.arrays import Array

SLOW_M_S = 5.0e-3


def external_force(trace: Trace) -> Array:
    """(7) with the frame's weight taken out: (pA - alpha pB) A_A + m g - F_f(v), N; v from the
    encoder.
    """
    friction = friction_force(identified().identification.model.friction, velocity(trace))
    return np.asarray(trace.two_chamber_n + WEIGHT_N - friction)


def experiment() -> Result:
    """In the air the true external force is zero: whatever is left is error."""
    trace = in_the_air()
    force, speed = external_force(trace), velocity(trace)
    slow = np.abs(speed) < SLOW_M_S
    still = smooth(force, 3.0)
    peak = float(np.abs(still[slow]).max()) / float(np.quantile(np.abs(still[~slow]), 0.99))
    before = rms(trace.two_chamber_n + WEIGHT_N)
    after = rms(force)
    time_s, shown = trace.time_s - trace.time_s[0], slice(None, None, 5)
    return Result(
        {
            "mean": abs(float(force.mean())),
            "left": after / before,
            "peaks": peak,
            "fast": rms(force[~slow]),
        },
        {
            "force": [
                Line(
                    time_s[shown],
                    (trace.two_chamber_n + WEIGHT_N)[shown],
                    "two chambers (3) and weight",
                    3,
                ),
                Line(time_s[shown], force[shown], "less friction (7)", 0),
            ],
            "speed": [Line(time_s[shown], speed[shown] * 1e3, "from the encoder", 1)],
        },
    )
