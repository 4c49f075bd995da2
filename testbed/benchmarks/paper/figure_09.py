"""Figure 9: the differential force at slow reversals: compression of the oil, stick-slip."""

from __future__ import annotations

import numpy as np

from testbed.benchmarks.paper.experiment import Experiment, Line, Panel, at_least, at_most
from testbed.benchmarks.paper.leg import RATE_HZ, Trace, run
from testbed.benchmarks.paper.stick_slip import (
    SOME,
    SPEEDS_M_S,
    net_damping_n_s_m,
    sensitivity,
    slips_at,
    slow_reversals,
)
from testbed.estimation.leg.motion import smooth
from testbed.report.tables import Table

SLOW_M_S, TRAVEL_M = 1.0e-3, 0.010
COUNT_M = 1.0e-4
BELOW_M_S, ABOVE_M_S = 5.0e-3, 10.0e-3
"""The paper's bound of stick-slip, and a speed well above it."""


def compression_n(trace: Trace, window_s: float = 4.0) -> float:
    """Median over reversals of the change of force before the encoder moves by one count, N."""
    wanted = np.sign(np.diff(trace.reference_m, prepend=trace.reference_m[0]))
    turns = np.flatnonzero((wanted[1:] * wanted[:-1]) < 0.0) + 1
    force, out = smooth(trace.two_chamber_n, 10.0), []
    for k in turns:
        stop = min(k + int(window_s * RATE_HZ), len(force))
        shown = trace.encoder_m[k:stop]
        direction = wanted[k]
        # from where the piston stood at its furthest until it is one count back
        furthest = int(np.argmax(-direction * shown))
        moved = np.flatnonzero(direction * (shown - shown[furthest]) >= COUNT_M * 0.99)
        moved = moved[moved > furthest]
        if moved.size:
            out.append(float(np.ptp(force[k : k + int(moved[0])])))
    return float(np.median(out)) if out else float("nan")


def experiment() -> Experiment:
    """Reverse slowly and look for both marks."""
    trace = run(slow_reversals(), seed=9).after(1.0)
    counts = [slips_at(v) for v in SPEEDS_M_S]
    margins = [net_damping_n_s_m(v) for v in SPEEDS_M_S]
    slow = [n for n, v in zip(counts, SPEEDS_M_S, strict=True) if v <= BELOW_M_S]
    fast = [n for n, v in zip(counts, SPEEDS_M_S, strict=True) if v >= ABOVE_M_S]
    sticking = run(slow_reversals(1, BELOW_M_S, 8.0e-3), seed=9).after(1.0)
    t, s, u = trace.time_s, slice(None, None, 5), slice(0, 1500)
    return Experiment(
        "9",
        "Differential force: compression and stick-slip",
        "The differential force shows the compression of the fluid before the joint moves, and the marks of "
        "stick-slip.",
        f"{TRAVEL_M * 1e3:g} mm out and back at {SLOW_M_S * 1e3:g} mm/s in the air, cold oil; stick-slip counted at "
        "seven speeds, four seconds out and back.",
        [
            at_least(
                "9",
                "the force changes before the encoder sees any motion at a reversal (median)",
                300.0,
                compression_n(trace),
                "N",
            ),
            at_least(
                "9",
                "stick-slip at 5 mm/s: the piston stands and then slips at more than twice the speed",
                float(SOME),
                float(counts[SPEEDS_M_S.index(BELOW_M_S)]),
                "times",
            ),
            at_least(
                "9",
                "and below (at the worst slower speed)",
                float(SOME),
                float(max(slow[:-1])),
                "times",
            ),
            at_most("9", "and none at 10 mm/s", 0.0, float(max(fast)), "times"),
        ],
        [
            Panel(
                "differential force",
                "time [s]",
                "F [N]",
                [Line(t[s], smooth(trace.two_chamber_n, 3.0)[s], "(3)")],
            ),
            Panel(
                "position",
                "time [s]",
                "x [mm]",
                [
                    Line(t[s], (trace.encoder_m[s] - 0.25) * 1e3, "encoder", 0),
                    Line(t[s], (trace.reference_m[s] - 0.25) * 1e3, "set point", 3, "--"),
                ],
            ),
            Panel(
                "5 mm/s: true speed",
                "time [s]",
                "v [mm/s]",
                [Line(sticking.time_s[u], sticking.speed_m_s[u] * 1e3, "speed", 1)],
            ),
            Panel(
                "5 mm/s: differential force",
                "time [s]",
                "F [N]",
                [Line(sticking.time_s[u], sticking.two_chamber_n[u], "(3) as read")],
            ),
        ],
        [
            Table(
                "Stick-slips in eight seconds, and net damping [kN s/m] (negative: sliding is unstable)",
                [f"{v * 1e3:g} mm/s" for v in SPEEDS_M_S],
                [[f"{n} ({m / 1e3:+.1f})" for n, m in zip(counts, margins, strict=True)]],
            ),
            sensitivity(
                {},
                "Speeds [mm/s] with stick-slip, simulated (and where the net damping is "
                "negative): 27 um and +180 N is the declared seal",
            ),
        ],
        [
            "The condition (stick_slip.py): the Stribeck curve must fall faster than viscous friction and the oil's "
            "damping rise, and the bristle must follow within a swing of the frame on the oil. With 2 % of air and a few "
            "bar in the chambers the oil column is several times softer than at half the supply, the swing as much "
            "slower, and the declared bristle of 27 um follows it: no stiffer seal is needed.",
        ],
    )
