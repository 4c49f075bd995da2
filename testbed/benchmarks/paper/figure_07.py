"""Figure 7: the same motion, both chambers."""

from __future__ import annotations

import numpy as np

from testbed.benchmarks.estimators.identification_trials import friction_force
from testbed.benchmarks.paper.experiment import (
    Array,
    Experiment,
    Line,
    Panel,
    at_least,
    at_most,
)
from testbed.benchmarks.paper.figure_06 import WEIGHT_N, calibrated_n, in_the_air
from testbed.benchmarks.paper.figure_08 import identified, velocity
from testbed.benchmarks.paper.leg import MASS_KG, RATE_HZ
from testbed.estimation.leg.motion import smooth
from testbed.report.tables import Table


def rms(x: Array) -> float:
    """Root mean square of an array, in its unit."""
    return float(np.sqrt(np.mean(np.square(x))))


def experiment() -> Experiment:
    """Split the two-chamber force into weight, friction, acceleration and what is left."""
    trace = in_the_air()
    force = trace.two_chamber_n
    friction = friction_force(identified().identification.model.friction, velocity(trace))
    acceleration = MASS_KG * np.gradient(smooth(trace.speed_m_s, 20.0)) * RATE_HZ
    rest = smooth(force + WEIGHT_N - friction - acceleration, 20.0)
    one = smooth(calibrated_n(trace), 20.0)
    # what chamber A says beside weight, friction and acceleration: the circuit's part
    circuit_one = (
        one - one.mean() - (friction - friction.mean()) - (acceleration - acceleration.mean())
    )
    t = trace.time_s - trace.time_s[0]
    rows = [
        ["friction", f"{rms(friction):.0f}"],
        ["weight", f"{WEIGHT_N:.0f}"],
        ["acceleration", f"{rms(acceleration):.1f}"],
        ["circuit, both chambers", f"{rms(rest):.1f}"],
        ["circuit, chamber A alone", f"{rms(circuit_one):.0f}"],
    ]
    share = 1.0 - float(np.var(force + WEIGHT_N - friction) / np.var(force))
    s = slice(None, None, 10)
    return Experiment(
        "7",
        "Both chambers, foot in the air",
        "The force from both chambers (3) follows the moved load; friction remains, the effects of acceleration and "
        "of the circuit are much smaller.",
        "The run of figure 6, with (3) instead of (1).",
        [
            at_least(
                "7",
                "friction explains the two-chamber force beside the weight (share of variance)",
                0.9,
                share,
                "1",
            ),
            at_most(
                "7",
                "acceleration is much smaller than friction (ratio of RMS)",
                0.2,
                rms(acceleration) / rms(friction),
                "1",
            ),
            at_most(
                "7",
                "effects of the circuit are much smaller than friction (ratio of RMS)",
                0.2,
                rms(rest) / rms(friction),
                "1",
            ),
            at_most(
                "7",
                "and much smaller than with one chamber (ratio of RMS)",
                0.2,
                rms(rest) / rms(circuit_one),
                "1",
            ),
            at_most(
                "7",
                "mean of the force is the hanging frame (error of the mean)",
                0.1 * WEIGHT_N,
                abs(float(force.mean()) + WEIGHT_N - float(friction.mean())),
                "N",
            ),
        ],
        [
            Panel(
                "two-chamber force",
                "time [s]",
                "F [N]",
                [
                    Line(t[s], force[s], "both chambers (3)"),
                    Line(t[s], friction[s] - WEIGHT_N, "identified friction less weight", 1, "--"),
                    Line(t[s], acceleration[s] - WEIGHT_N, "acceleration less weight", 3),
                ],
            )
        ],
        [Table("Parts of the force, RMS", ["part", "N"], rows)],
        [
            "Friction is (5) as identified in figure 8 from other motions, velocity is the encoder's: what they miss is in "
            "the rest, so the claims can fail. Sensors are calibrated without error and have no thermal zero."
        ],
    )
