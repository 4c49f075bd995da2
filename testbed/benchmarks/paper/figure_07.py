"""Figure 7: the same motion, both chambers."""

from __future__ import annotations

import numpy as np

from testbed.benchmarks.estimators.identification_trials import friction_force
from testbed.benchmarks.harness import rms
from testbed.benchmarks.paper.experiment import Line, Result
from testbed.benchmarks.paper.figure_06 import WEIGHT_N, calibrated_n, in_the_air
from testbed.benchmarks.paper.figure_08 import identified, velocity
from testbed.benchmarks.paper.leg import MASS_KG, RATE_HZ
from testbed.estimation.leg.motion import smooth


def experiment() -> Result:
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
    time_s = trace.time_s - trace.time_s[0]
    rows = [
        ["friction", f"{rms(friction):.0f}"],
        ["weight", f"{WEIGHT_N:.0f}"],
        ["acceleration", f"{rms(acceleration):.1f}"],
        ["circuit, both chambers", f"{rms(rest):.1f}"],
        ["circuit, chamber A alone", f"{rms(circuit_one):.0f}"],
    ]
    share = 1.0 - float(np.var(force + WEIGHT_N - friction) / np.var(force))
    shown = slice(None, None, 10)
    return Result(
        {
            "friction": share,
            "acceleration": rms(acceleration) / rms(friction),
            "circuit": rms(rest) / rms(friction),
            "one_chamber": rms(rest) / rms(circuit_one),
            "mean": abs(float(force.mean()) + WEIGHT_N - float(friction.mean())),
        },
        {
            "force": [
                Line(time_s[shown], force[shown], "both chambers (3)"),
                Line(
                    time_s[shown],
                    friction[shown] - WEIGHT_N,
                    "identified friction less weight",
                    1,
                    "--",
                ),
                Line(time_s[shown], acceleration[shown] - WEIGHT_N, "acceleration less weight", 3),
            ]
        },
        {"parts": rows},
    )
