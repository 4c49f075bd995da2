"""Figure 11: the external force (7) on the sinusoid."""

from __future__ import annotations

import numpy as np

from testbed.benchmarks.estimators.identification_trials import friction_force
from testbed.benchmarks.paper.experiment import Array, Experiment, Line, Panel, at_least, at_most
from testbed.benchmarks.paper.figure_06 import WEIGHT_N, in_the_air
from testbed.benchmarks.paper.figure_08 import identified, velocity
from testbed.benchmarks.paper.leg import Trace
from testbed.estimation.leg.motion import smooth

RESOLUTION_N = 96.0
"""The paper's own figure: 0.25 % of 100 bar on the piston."""
SLOW_M_S = 5.0e-3


def external_force(trace: Trace) -> Array:
    """(7) with the frame's weight taken out: (pA - alpha pB) A_A + m g - F_f(v), N; v from the
    encoder.
    """
    friction = friction_force(identified().identification.model.friction, velocity(trace))
    return np.asarray(trace.two_chamber_n + WEIGHT_N - friction)


def experiment() -> Experiment:
    """In the air the true external force is zero: whatever is left is error."""
    trace = in_the_air()
    force, v = external_force(trace), velocity(trace)
    slow = np.abs(v) < SLOW_M_S
    still = smooth(force, 3.0)
    peak = float(np.abs(still[slow]).max()) / float(np.quantile(np.abs(still[~slow]), 0.99))
    before = float(np.sqrt(np.mean((trace.two_chamber_n + WEIGHT_N) ** 2)))
    after = float(np.sqrt(np.mean(force**2)))
    t, s = trace.time_s - trace.time_s[0], slice(None, None, 5)
    return Experiment(
        "11",
        "External force on the sinusoid",
        "With friction taken out (7), the external force of the leg in the air lies around zero; peaks are left at low "
        "speed.",
        "The run of figure 6, friction as identified in figure 8, the frame's weight taken out.",
        [
            at_most(
                "11",
                "around zero: mean within the quoted resolution",
                RESOLUTION_N,
                abs(float(force.mean())),
                "N",
            ),
            at_most(
                "11",
                "(7) leaves little of the force (RMS after over RMS before)",
                0.5,
                after / before,
                "1",
            ),
            at_least(
                "11",
                "peaks are left at low speed (largest below 5 mm/s over the 99 % quantile above)",
                2.0,
                peak,
                "1",
            ),
            at_most(
                "11",
                "above 5 mm/s the error is within the quoted resolution (RMS)",
                RESOLUTION_N,
                float(np.sqrt(np.mean(force[~slow] ** 2))),
                "N",
            ),
        ],
        [
            Panel(
                "external force",
                "time [s]",
                "F [N]",
                [
                    Line(
                        t[s], (trace.two_chamber_n + WEIGHT_N)[s], "two chambers (3) and weight", 3
                    ),
                    Line(t[s], force[s], "less friction (7)", 0),
                ],
            ),
            Panel("speed", "time [s]", "v [mm/s]", [Line(t[s], v[s] * 1e3, "from the encoder", 1)]),
        ],
    )
