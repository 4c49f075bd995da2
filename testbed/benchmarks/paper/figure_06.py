"""Figure 6: the vertical joint in the air, sinusoidal speed, chamber A alone."""

from __future__ import annotations

import numpy as np

from testbed.benchmarks.paper.experiment import Line, Result
from testbed.benchmarks.paper.figure_04 import (
    CELL_AT_M,
    K_PA_PER_V,
    Regression,
    held_samples,
    press,
    straight_line,
)
from testbed.benchmarks.paper.leg import MASS_KG, Trace, once_per_machine, run, sinusoid
from testbed.formats.arrays import Array
from testbed.machine.names import GRAVITY_M_S2

WEIGHT_N = MASS_KG * GRAVITY_M_S2
PAPER_PEAK_N = 2100.0
TOLERANCE = 0.15
"""Share by which a peak may differ and still be about 2100 N."""


@once_per_machine
def in_the_air() -> Trace:
    """The sinusoid after its first cycle: 0.1 m at 0.1 Hz, foot off the ground."""
    return run(sinusoid()).after(1.0 + 10.0)


@once_per_machine
def at_the_cell() -> Regression:
    """The regression (2) of figure 4 for sensors without error."""
    trace = run(press(), cell_at_m=CELL_AT_M)
    held = held_samples(trace)
    return straight_line(trace.read_a_pa[held] / K_PA_PER_V, trace.load_n[held], trace.area_a_m2)


def calibrated_n(trace: Trace) -> Array:
    """The one-chamber force (n), N, under figure 4's regression (2)."""
    line = at_the_cell()
    return np.asarray(line.a * trace.one_chamber_n + line.b * K_PA_PER_V * trace.area_a_m2)


def peak_n(force_n: Array) -> float:
    """Largest size of a force (n), N, smoothed over 20 ms so that noise makes no peak."""
    return float(np.abs(np.convolve(force_n, np.ones(20) / 20.0, "valid")).max())


def experiment() -> Result:
    """The peak under the calibration of figure 4."""
    trace, line = in_the_air(), at_the_cell()
    force = calibrated_n(trace)
    peak = peak_n(force)
    time_s = trace.time_s - trace.time_s[0]
    rows = [
        ["peak under (2), N", f"{peak:.0f}"],
        ["peak of pA A_A as it stands, N", f"{peak_n(trace.one_chamber_n):.0f}"],
        ["a", f"{line.a:.4f}"],
        ["b, N", f"{line.b * K_PA_PER_V * trace.area_a_m2:.0f}"],
        ["pA, bar", _span(trace.pressure_a_pa)],
        ["pB, bar", _span(trace.pressure_b_pa)],
    ]
    shown = slice(None, None, 10)
    time_s, level = time_s[shown], np.ones(len(time_s[shown]))
    return Result(
        {"peak": peak},
        {
            "force": [
                Line(time_s, force[shown], "chamber A (1), regression (2)"),
                Line(time_s, PAPER_PEAK_N * level, "2100 N", 2, "--"),
                Line(time_s, -WEIGHT_N * level, "weight of the frame (pulls)", 3, "--"),
            ],
            "pressures": [
                Line(time_s, trace.read_a_pa[shown] / 1e5, "A"),
                Line(time_s, trace.read_b_pa[shown] / 1e5, "B", 1),
            ],
        },
        {"parts": rows},
    )


def _span(pressure_pa: Array) -> str:
    return f"{pressure_pa.min() / 1e5:.1f} to {pressure_pa.max() / 1e5:.1f}"
